#include "surface/surface.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "options/spelling.h"

namespace pellicle::surface {

std::vector<bool> members_of_group(const Surface& points, const std::string& key, const std::string& group) {
  const auto found = points.groups.find(group);
  if (found == points.groups.end()) {
    std::vector<std::string> names;
    for (const auto& entry : points.groups) {
      names.push_back(entry.first);
    }
    const std::size_t most = 12;
    const auto end_of_list = names.begin() + static_cast<std::ptrdiff_t>(std::min(most, names.size()));
    const std::string rest = names.size() > most ? fmt::format(", ... ({} in all)", names.size()) : "";
    throw Error(key + ": '" + group + "' is no group of the mesh, " +
                (names.empty()
                     ? "which has none"
                     : fmt::format("expected one of {}{}; the nearest is {}",
                                   fmt::join(names.begin(), end_of_list, ", "), rest, nearest(group, names))));
  }
  std::vector<bool> members(points.particles.local(), false);
  for (const PetscInt particle : found->second) {
    members[particle] = true;
  }
  return members;
}

}  // namespace pellicle::surface
