#include "base/object_tables.h"

#include <algorithm>

namespace pellicle {
inline namespace base {

std::vector<ObjectTable> ObjectTables::of(const std::string& object) const {
  std::vector<ObjectTable> result;
  std::copy_if(begin(), end(), std::back_inserter(result),
               [&object](const ObjectTable& one) { return object.empty() || one.name == object; });
  return result;
}

std::pair<std::string, std::string> ObjectTables::split_name(const std::string& name) const { return split(name, '_'); }

std::pair<std::string, std::string> ObjectTables::split_key(const std::string& key) const { return split(key, '.'); }

std::pair<std::string, std::string> ObjectTables::split(const std::string& text, char separator) const {
  const std::string all = std::string("objects") + separator;
  std::pair<std::string, std::string> found{"", text};
  for (const ObjectTable& one : tables_) {
    const std::string start = all + one.name + separator;
    if (one.name.size() > found.first.size() && text.compare(0, start.size(), start) == 0) {
      found = {one.name, text.substr(start.size())};
    }
  }
  return found;
}

std::string object_prefix(const std::string& object) { return object.empty() ? "" : "objects_" + object + "_"; }

}  // namespace base
}  // namespace pellicle
