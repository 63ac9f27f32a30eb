#pragma once

#include <string>
#include <vector>

#include "surface/surface.h"

namespace pellicle::surface {

/// Whether each local particle is in a named group of the mesh. Not collective.
/// @param key of the option that names the group, "pins.rail.group"
/// @throws Error that lists the mesh's groups, the same on every rank, if there is no such group
std::vector<bool> members_of_group(const Surface& points, const std::string& key, const std::string& group);

}  // namespace pellicle::surface
