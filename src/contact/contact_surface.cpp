#include "contact/contact_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>

#include "parallel/collective.h"
#include "surface/drawn_surface.h"

namespace pellicle::contact {

namespace {

/// The thickness as a fraction of the mean side of a mesh, unless it is given.
constexpr double usual_thickness = 0.2;

std::vector<Layout> layouts_of(const std::vector<ContactSurface::Part>& parts, Layout Surface::*layout) {
  std::vector<Layout> layouts;
  std::transform(parts.begin(), parts.end(), std::back_inserter(layouts),
                 [layout](const ContactSurface::Part& part) { return part.surface->*layout; });
  return layouts;
}

}  // namespace

double ContactSurface::Part::thickness_or_usual() const {
  return thickness ? *thickness : usual_thickness * mean_side(*surface);
}

ContactSurface::ContactSurface(const std::vector<Part>& parts)
    : parts_(parts),
      particles_(layouts_of(parts, &Surface::particles)),
      elements_(layouts_of(parts, &Surface::elements)),
      local_elements_(elements_.layout().local()),
      rest_(3, particles_.layout().local()),
      part_(particles_.layout().local()) {
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Surface& part = *parts[p].surface;
    parts_[p].thickness = parts[p].thickness_or_usual();
    largest_thickness_ = std::max(largest_thickness_, *parts_[p].thickness);
    for (PetscInt i = 0; i < part.particles.local(); ++i) {
      rest_.col(particles_.local(p, i)) = part.rest.col(i);
      part_[particles_.local(p, i)] = p;
    }
    for (PetscInt e = 0; e < part.elements.local(); ++e) {
      const std::size_t number = e;
      Element& element = local_elements_[elements_.local(p, e)];
      for (PetscInt k = 0; k < part.sides_per_element(); ++k) {
        element.corners[k] = particles_.local(p, part.corner(number, k));
      }
      if (part.has_quads() && part.is_lattice[part.lattice[number]]) {
        element.lattice = particles_.local(p, part.lattice[number]);
      }
      element.area = element_area_vector(part, part.rest.data(), number).norm();
    }
    set_active(p, std::vector<bool>(part.triangles.size(), true));
  }
}

void ContactSurface::set_active(std::size_t part, const std::vector<bool>& triangles) {
  const std::size_t each = parts_[part].surface->triangles_per_element;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    local_elements_[elements_.local(part, static_cast<PetscInt>(t / each))].lives[t % each] = triangles[t];
  }
}

double mean_side(const Surface& surface) {
  std::array<double, 2> sums{};  // of sides, two of each element, and how many
  for (PetscInt e = 0; e < surface.elements.owned; ++e) {
    for (std::size_t k = 0; k < 2; ++k) {
      sums[0] += (surface.rest.col(surface.corner(e, k + 1)) - surface.rest.col(surface.corner(e, k))).norm();
      sums[1] += 1;
    }
  }
  sums = sum_over_ranks(surface.comm(), sums);
  return sums[0] / std::max(1.0, sums[1]);
}

double usual_contact_stiffness(const Surface& surface, double tension, double areal_mass, double h) {
  const double side = mean_side(surface);
  return 20 * tension / (side * side) + 4 * areal_mass / (h * h);
}

}  // namespace pellicle::contact
