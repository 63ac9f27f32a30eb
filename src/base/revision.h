#pragma once

#include "base/namespaces.h"

namespace pellicle::base {

/// Version of the program, such as "0.1".
const char* version();

/// The git commit that was built, with "-dirty" when tracked files had been changed, or "unknown" outside a repository.
const char* git_revision();

}  // namespace pellicle::base
