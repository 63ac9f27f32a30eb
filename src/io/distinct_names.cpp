#include "io/distinct_names.h"

#include "base/error.h"
#include "options/spelling.h"

namespace pellicle {
inline namespace io {

void DistinctNames::add(const std::string& name, const std::string& owner) {
  const auto [first, is_new] = named_.emplace(in_lower_case(name), Named{name, owner});
  if (!is_new) {
    const auto words = [](const std::string& owner) { return owner.empty() ? "the program itself" : owner; };
    const bool is_same = first->second.name == name;
    throw Error(words(first->second.owner) + " and " + words(owner) + " both name the " + kind_ + " " + name +
                (is_same ? "" : " (or " + first->second.name + ", which differs by upper and lower case alone)") +
                place_ + "; expected another name of one of them");
  }
}

}  // namespace io
}  // namespace pellicle
