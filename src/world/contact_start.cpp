#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "base/error.h"
#include "contact/crack_faces.h"
#include "contact/crossings.h"
#include "contact/surface_contact.h"
#include "contact/untangle.h"
#include "parallel/collective.h"
#include "world/group.h"

namespace pellicle::world {

namespace {

/// @throws Error if the thickness is so large that each feature would press on hundreds of others
void check_thickness(const std::string& object, const ContactSurface::Part& part) {
  constexpr double most_sides = 10;
  const double side = mean_side(*part.surface);
  const double thickness = part.thickness.value_or(0);
  if (thickness > most_sides * side) {
    throw Error(fmt::format(
        "{}contact.thickness: {:.3g} m is out of range; expected at most {:.3g} m, {:.0f} mean sides of the mesh",
        heading_of(object), thickness, most_sides * side, most_sides));
  }
}

/// Distance up to which surfaces touch: contact brings nothing nearer to each other. Collective. [m]
double touching_distance(const std::vector<CrackedSurface>& surfaces) {
  double thickness = std::numeric_limits<double>::infinity();
  for (const CrackedSurface& surface : surfaces) {
    thickness = std::min(thickness, surface.part.thickness_or_usual());
  }
  return SurfaceContact::least_gap * thickness;
}

Crossings crossings_of(const std::vector<CrackedSurface>& surfaces) {
  std::vector<PlacedSurface> placed;
  for (const CrackedSurface& surface : surfaces) {
    placed.push_back({*surface.part.surface, surface.position, surface.active});
  }
  return find_crossings(placed, touching_distance(surfaces));
}

bool is_clean(const Crossings& crossings) { return crossings.pairs == 0 && crossings.touching == 0; }

using Key = std::pair<std::size_t, PetscInt>;  ///< surface, and persistent id of a particle

/// An element in the form that every rank gets.
struct StartingElement {
  std::size_t surface = 0;
  PetscInt number = 0;
  std::array<PetscInt, 4> corners{-1, -1, -1, -1};
  std::array<double, 12> places{};
  std::array<bool, 4> constrained{};
  std::array<bool, 4> lives{};
};

std::vector<StartingElement> all_elements(const std::vector<CrackedSurface>& surfaces) {
  std::vector<StartingElement> own;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const Surface& surface = *surfaces[s].part.surface;
    const auto each = static_cast<std::size_t>(surface.triangles_per_element);
    for (PetscInt e = 0; e < surface.elements.owned; ++e) {
      StartingElement element;
      element.surface = s;
      element.number = surface.element_id[e];
      for (PetscInt k = 0; k < surface.sides_per_element(); ++k) {
        const PetscInt corner = surface.corner(e, k);
        element.corners[k] = surface.persistent_id[corner];
        element.constrained[k] = surfaces[s].constrained[corner];
        std::copy_n(surfaces[s].position.vector(corner).data(), 3,
                    element.places.begin() + static_cast<std::ptrdiff_t>(3 * k));
      }
      for (std::size_t t = 0; t < each; ++t) {
        element.lives[t] = surfaces[s].active == nullptr || (*surfaces[s].active)[each * e + t];
      }
      own.push_back(element);
    }
  }
  std::vector<StartingElement> all = of_all_ranks(surfaces.front().part.surface->comm(), own);
  std::sort(all.begin(), all.end(), [](const StartingElement& a, const StartingElement& b) {
    return std::tie(a.surface, a.number) < std::tie(b.surface, b.number);
  });
  return all;
}

/// Moves the particles of all surfaces; every rank finds the same places.
void untangle_all(const std::vector<CrackedSurface>& surfaces) {
  TangledMesh mesh;
  mesh.touch = touching_distance(surfaces);
  std::map<Key, int> numbers;
  std::vector<std::pair<std::array<int, 4>, std::array<bool, 4>>> quads;
  for (const StartingElement& element : all_elements(surfaces)) {
    std::array<int, 4> corners{-1, -1, -1, -1};
    for (std::size_t k = 0; k < 4 && element.corners[k] >= 0; ++k) {
      const auto [number, is_new] =
          numbers.emplace(Key(element.surface, element.corners[k]), static_cast<int>(mesh.particles.size()));
      if (is_new) {
        mesh.particles.emplace_back(element.places.data() + 3 * k);
        mesh.constrained.push_back(element.constrained[k]);
      }
      corners[k] = number->second;
    }
    if (corners[3] >= 0) {
      quads.emplace_back(corners, element.lives);
    } else if (element.lives[0]) {
      mesh.triangles.push_back({corners[0], corners[1], corners[2]});
    }
  }
  for (const auto& [corners, lives] : quads) {
    const auto centre = static_cast<int>(mesh.particles.size() + mesh.centres.size());
    mesh.centres.push_back(corners);
    for (std::size_t t = 0; t < 4; ++t) {
      if (lives[t]) {
        mesh.triangles.push_back({corners[t], corners[(t + 1) % 4], centre});
      }
    }
  }
  untangle(mesh);
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const Surface& surface = *surfaces[s].part.surface;
    Field& position = surfaces[s].position;
    for (PetscInt i = 0; i < surface.particles.owned; ++i) {
      const auto found = numbers.find({s, surface.persistent_id[i]});
      if (found != numbers.end()) {
        position.vector(i) = mesh.particles[found->second];
      }
    }
    position.update_ghosts();
  }
}

/// The lattice points of quads go with their corners, and are moved by nothing else. Collective.
void carry_lattice(const std::vector<CrackedSurface>& surfaces, const std::vector<Eigen::Matrix3Xd>& before) {
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const Surface& surface = *surfaces[s].part.surface;
    Field& position = surfaces[s].position;
    for (std::size_t e = 0; surface.has_quads() && e < static_cast<std::size_t>(surface.elements.owned); ++e) {
      const PetscInt lattice = surface.lattice[e];
      if (surface.is_lattice[lattice] && !surfaces[s].constrained[lattice]) {
        position.vector(lattice) = before[s].col(lattice);
        for (const PetscInt corner : surface.cells[e]) {
          position.vector(lattice) += (position.vector(corner) - before[s].col(corner)) / 4;
        }
      }
    }
    position.update_ghosts();
  }
}

/// Moves surfaces apart by contact's own constraints. Collective.
void push_apart(const ContactOptions& options, const std::vector<CrackedSurface>& surfaces) {
  std::vector<ContactSurface::Part> parts;
  for (const CrackedSurface& surface : surfaces) {
    parts.push_back(surface.part);
  }
  SurfaceContact contact(parts, options, false);
  const JoinedLayout& joined = contact.joined();
  Field x(joined.layout(), 3);
  for (std::size_t p = 0; p < surfaces.size(); ++p) {
    contact.set_surface(surfaces[p].constrained, surfaces[p].active, p);
    joined.put(p, surfaces[p].position, x);
  }
  contact.push_apart(x);
  for (std::size_t p = 0; p < surfaces.size(); ++p) {
    joined.take(p, x, surfaces[p].position);
    surfaces[p].position.update_ghosts();
  }
}

}  // namespace

std::string settle_start(const ContactOptions& options, const std::vector<Object*>& objects) {
  std::vector<CrackedSurface> surfaces;
  std::vector<std::string> names;
  for (Object* object : objects) {
    const Motion& motion = object->motion();
    check_thickness(object->name(), motion.contact_part());
    surfaces.push_back({motion.contact_part(), motion.active(), motion.constrained(), {}, object->state().position});
    names.push_back(object->name());
  }
  const Crossings crossings = crossings_of(surfaces);
  if (is_clean(crossings)) {
    return "";
  }
  const std::string tangle = crossing_words(crossings, names);
  if (options.start == ContactStart::refuse) {
    throw Error("contact.start: refuse: " + tangle + ", expected none, or contact.start: untangle or accept");
  }
  if (options.start == ContactStart::accept) {
    return tangle + "; they are left so, see contact.start";
  }
  std::vector<Eigen::Matrix3Xd> before;
  for (const CrackedSurface& surface : surfaces) {
    before.emplace_back(surface.position.values());
  }
  untangle_all(surfaces);
  if (!is_clean(crossings_of(surfaces))) {
    throw Error("contact.start: untangle: of " + tangle +
                ", some stay so, expected surfaces that come free of themselves when they are moved a little, and of "
                "each other, one of any two without pins");
  }
  push_apart(options, surfaces);
  carry_lattice(surfaces, before);
  for (Object* object : objects) {
    object->start();
  }
  double most = 0;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    if (before[s].cols() > 0) {
      most = std::max(most, (surfaces[s].position.values() - before[s]).colwise().norm().maxCoeff());
    }
  }
  most = max_over_ranks(surfaces.front().part.surface->comm(), most);
  return fmt::format("{}; untangled, no particle was moved by more than {:.3g} m", tangle, most);
}

}  // namespace pellicle::world
