#include "contact/contact_surface.h"

#include <algorithm>
#include <iterator>

#include "parallel/collective.h"
#include "surface/drawn_surface.h"

namespace pellicle::contact {

namespace {

std::vector<Layout> layouts_of(const std::vector<ContactSurface::Part>& parts, Layout Surface::*layout) {
  std::vector<Layout> layouts;
  std::transform(parts.begin(), parts.end(), std::back_inserter(layouts),
                 [layout](const ContactSurface::Part& part) { return part.surface->*layout; });
  return layouts;
}

}  // namespace

void describe(OptionTable& table, ContactOptions& options, const Condition& bodies, const Condition& body_friction) {
  const Condition touches{"bodies, or contact.self", [&options, bodies] { return options.self || bodies.holds(); }};
  const Condition rubs{"a body with friction, or contact.friction", [&options, body_friction] {
                         return (options.self && options.friction > 0) || body_friction.holds();
                       }};
  const Condition touches_itself{"contact.self: true", [&options] { return options.self; }};
  table.add("contact.self", options.self,
            "surfaces touch themselves, no part passes through another; objects that have it touch each other, too");
  table.add(
      "contact.start", options.start, Rules().acts_with(touches_itself),
      "surfaces that pass through themselves or each other at the start: accept: what is crossed stays so; untangle: "
      "moves them until nothing crosses and they are as far apart as contact keeps them; refuse: no run");
  table.add("contact.check", options.check,
            "counts after every step the pairs of drawn triangles that cut through each other (history: crossings)");
  table.add("contact.thickness", options.thickness, Rules("m").more_than(0).acts_with(touches),
            "gap at which surfaces begin to press: two parts of a surface, by half of their undeformed distance at "
            "most, and bodies, beyond their margin; of parts at most ten mean sides of the mesh; unless given a fifth "
            "of that side, for bodies a tenth",
            "docs/theory.md: parameters");
  table.add("contact.friction", options.friction, Rules().at_least(0).acts_with(touches_itself),
            "coefficient of Coulomb friction between parts of a surface");
  table.add("contact.stiffness", options.stiffness, Rules("Pa/m").more_than(0).acts_with(touches),
            "c of the pressure with which surfaces press whose gap g is less than contact.thickness d: c (d - g)^2/(2 "
            "d); of bodies c (0.975 d - g) where g < 0.95 d, then falling smoothly to 0 at d: unless given much "
            "stiffer than the mesh in the plane and its mass in a step; of two objects the softer counts",
            "docs/theory.md: parameters");
  table.add("contact.slip_speed", options.slip_speed, Rules("m/s").more_than(0).acts_with(rubs),
            "along a surface: friction grows up to this speed, at which it is Coulomb's", "docs/theory.md: parameters");
}

double ContactSurface::Part::thickness_or_usual() const {
  constexpr double usual = 0.2;  // of the mean side
  return thickness ? *thickness : usual * mean_side(*surface);
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
      Element& element = local_elements_[elements_.local(p, e)];
      for (PetscInt k = 0; k < part.sides_per_element(); ++k) {
        element.corners[k] = particles_.local(p, part.corner(e, k));
      }
      if (part.has_quads() && part.is_lattice[part.lattice[e]]) {
        element.lattice = particles_.local(p, part.lattice[e]);
      }
      element.area = element_area_vector(part, part.rest.data(), e).norm();
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

double contact_thickness(const Surface& surface, const ContactOptions& options) {
  constexpr double fraction = 0.1;
  return options.thickness ? *options.thickness : fraction * mean_side(surface);
}

double usual_contact_stiffness(const Surface& surface, double tension, double areal_mass, double h) {
  const double side = mean_side(surface);
  return 20 * tension / (side * side) + 4 * areal_mass / (h * h);
}

}  // namespace pellicle::contact
