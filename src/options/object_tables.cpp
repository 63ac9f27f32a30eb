#include "options/object_tables.h"

#include <algorithm>

namespace pellicle::options {

std::vector<ObjectTable> ObjectTables::of(const std::string& object) const {
  std::vector<ObjectTable> result;
  std::copy_if(begin(), end(), std::back_inserter(result),
               [&object](const ObjectTable& one) { return object.empty() || one.name == object; });
  return result;
}

std::pair<std::string, std::string> ObjectTables::split_name(const std::string& name) const {
  std::pair<std::string, std::string> found{"", name};
  for (const ObjectTable& one : tables_) {
    const std::string start = object_prefix(one.name);
    if (one.name.size() > found.first.size() && name.compare(0, start.size(), start) == 0) {
      found = {one.name, name.substr(start.size())};
    }
  }
  return found;
}

std::string object_prefix(const std::string& object) { return object.empty() ? "" : "objects_" + object + "_"; }

}  // namespace pellicle::options
