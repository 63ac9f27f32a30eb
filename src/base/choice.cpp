#include "base/choice.h"

#include <algorithm>

#include "base/error.h"
#include "base/spelling.h"

namespace pellicle {
inline namespace base {

void AnyChoice::set(const std::string& name) {
  const auto found = std::find(names_->begin(), names_->end(), name);
  if (found == names_->end()) {
    throw Error("\"" + name + "\" is not a choice, the nearest is " + nearest(name, *names_));
  }
  index_ = static_cast<std::size_t>(found - names_->begin());
}

}  // namespace base
}  // namespace pellicle
