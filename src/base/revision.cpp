#include "base/revision.h"

#include "revision_text.h"  // written by the build

namespace pellicle::base {

const char* version() { return PELLICLE_VERSION; }

const char* git_revision() { return PELLICLE_GIT_REVISION; }

}  // namespace pellicle::base
