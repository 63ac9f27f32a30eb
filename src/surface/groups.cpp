#include "surface/groups.h"

#include "base/error.h"
#include "options/spelling.h"

namespace pellicle {
inline namespace surface {

std::vector<bool> members_of_group(const Surface& points, const std::string& key, const std::string& group) {
  const auto found = points.groups.find(group);
  if (found == points.groups.end()) {
    constexpr std::size_t most = 12;
    std::vector<std::string> names;
    std::string list;
    for (const auto& entry : points.groups) {
      names.push_back(entry.first);
      if (names.size() <= most) {
        list += (list.empty() ? "" : ", ") + entry.first;
      }
    }
    throw Error(key + ": '" + group + "' is no group of the mesh, " +
                (names.empty()
                     ? "which has none"
                     : "expected one of " + list +
                           (names.size() > most ? ", ... (" + std::to_string(names.size()) + " in all)" : "") +
                           "; the nearest is " + nearest(group, names)));
  }
  std::vector<bool> members(points.particles.local(), false);
  for (const PetscInt particle : found->second) {
    members[particle] = true;
  }
  return members;
}

}  // namespace surface
}  // namespace pellicle
