#include "contact/contact_surface.h"

#include <algorithm>
#include <iterator>

namespace pellicle {
inline namespace contact {

namespace {

std::vector<Layout> layouts_of(const std::vector<const Surface*>& parts, Layout Surface::*layout) {
  std::vector<Layout> layouts;
  std::transform(parts.begin(), parts.end(), std::back_inserter(layouts),
                 [layout](const Surface* part) { return part->*layout; });
  return layouts;
}

}  // namespace

ContactSurface::ContactSurface(const std::vector<const Surface*>& parts)
    : particles_(layouts_of(parts, &Surface::particles)),
      elements_(layouts_of(parts, &Surface::elements)),
      local_elements_(static_cast<std::size_t>(elements_.layout().local())),
      rest_(3, particles_.layout().local()),
      living_(parts.size(), nullptr) {
  std::array<double, 2> sides{};  // sum of their lengths, two of each element, and how many
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Surface& part = *parts[p];
    for (PetscInt i = 0; i < part.particles.local(); ++i) {
      rest_.col(particles_.local(p, i)) = part.rest.col(i);
    }
    for (PetscInt e = 0; e < part.elements.local(); ++e) {
      const auto number = static_cast<std::size_t>(e);
      Element& element = local_elements_[static_cast<std::size_t>(elements_.local(p, e))];
      element.part = p;
      element.first_triangle = number * static_cast<std::size_t>(part.triangles_per_element);
      for (std::size_t k = 0; k < static_cast<std::size_t>(part.sides_per_element()); ++k) {
        element.corners[k] = particles_.local(p, part.corner(number, k));
      }
      const auto side = [&](std::size_t from, std::size_t to) {
        return Eigen::Vector3d(part.rest.col(part.corner(number, to)) - part.rest.col(part.corner(number, from)));
      };
      element.area = (part.has_quads() ? side(0, 2).cross(side(1, 3)) : side(0, 1).cross(side(0, 2))).norm() / 2;
      if (e < part.elements.owned) {
        sides[0] += side(0, 1).norm() + side(1, 2).norm();
        sides[1] += 2;
      }
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sides.data(), 2, MPI_DOUBLE, MPI_SUM, comm());
  mean_side_ = sides[0] / sides[1];
}

}  // namespace contact
}  // namespace pellicle
