#include "options/choice.h"

#include <algorithm>

#include "base/error.h"
#include "options/spelling.h"

namespace pellicle {
inline namespace options {

void AnyChoice::set(const std::string& name) {
  const auto found = std::find(names_->begin(), names_->end(), name);
  if (found == names_->end()) {
    throw Error("\"" + name + "\" is not a choice, the nearest is " + nearest(name, *names_));
  }
  index_ = static_cast<std::size_t>(found - names_->begin());
}

}  // namespace options
}  // namespace pellicle
