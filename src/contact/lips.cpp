#include "contact/lips.h"

#include <algorithm>
#include <cmath>

#include "parallel/collective.h"
#include "surface/drawn_places.h"

namespace pellicle {
inline namespace contact {

std::vector<PetscInt> parted_ids(const Surface& surface, const SplitCorners& corners) {
  std::vector<PetscInt> ids;
  for (const SplitCorners::Copy& copy : corners.copies) {
    ids.push_back(copy.id);
    ids.push_back(surface.persistent_id[static_cast<std::size_t>(copy.original)]);
  }
  ids = of_all_ranks(surface.comm(), ids);
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

void open_lips(const ContactSurface::Part& part, const std::vector<bool>& living, const std::vector<PetscInt>& ids,
               const std::vector<bool>& held, Field& position) {
  const Surface& surface = *part.surface;
  const double way = lip_share * part.thickness_or_usual();
  const auto owned = static_cast<std::size_t>(surface.particles.owned);
  std::vector<bool> is_parted(owned, false);
  for (std::size_t i = 0; i < owned; ++i) {
    is_parted[i] = !held[i] && std::binary_search(ids.begin(), ids.end(), surface.persistent_id[i]);
  }
  // Unit vectors into the triangles round a particle, summed over their angles there.
  Eigen::Matrix3Xd inwards = Eigen::Matrix3Xd::Zero(3, surface.particles.owned);
  const auto each = static_cast<std::size_t>(surface.triangles_per_element);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const std::array<PetscInt, 3>& triangle = surface.triangles[t];
    const std::size_t corners = surface.has_quads() ? 2 : 3;  // A quad's centre is not a corner.
    for (std::size_t k = 0; living[t] && k < corners; ++k) {
      const auto particle = static_cast<std::size_t>(triangle[k]);
      if (particle < owned && is_parted[particle]) {
        const std::array<Eigen::Vector3d, 3> at = DrawnPlaces(surface, position.data(), t / each)(triangle);
        const Eigen::Vector3d first = (at[(k + 1) % 3] - at[k]).stableNormalized();
        const Eigen::Vector3d second = (at[(k + 2) % 3] - at[k]).stableNormalized();
        const double sine = (first - second).norm();  // of half of the angle, twice
        inwards.col(triangle[k]) += sine * (first + second).stableNormalized();
      }
    }
  }
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    position.vector(i) += way * inwards.col(i).stableNormalized();
  }
  position.update_ghosts();
}

}  // namespace contact
}  // namespace pellicle
