#include "contact/crack_faces.h"

#include <algorithm>
#include <array>
#include <map>

#include "base/sorting.h"
#include "contact/surface_contact.h"
#include "geometry/triangle_intersection.h"
#include "parallel/collective.h"
#include "surface/drawn_surface.h"

namespace pellicle::contact {

namespace {

/// An active triangle round a crack face, by the ways from the crack face to its other corners.
struct FanTriangle {
  PetscInt id;  ///< of the crack face
  std::array<Eigen::Vector3d, 2> others;
  bool is_held;
};

/// The active triangles round a crack face, relative to the place of the crack face.
struct Fan {
  std::vector<std::array<Eigen::Vector3d, 2>> triangles;  ///< the corners other than the crack face
  bool is_held = false;
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
};

/// Towards the middle: unit vectors into the triangles, summed over their angles.
Eigen::Vector3d inwards(const Fan& fan) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [a, b] : fan.triangles) {
    const Eigen::Vector3d first = a.stableNormalized();
    const Eigen::Vector3d second = b.stableNormalized();
    sum += (first - second).norm() * (first + second).stableNormalized();  // twice the sine of half of the angle
  }
  return sum.stableNormalized();
}

/// Whether active triangles round two crack faces of a corner would cut through each other.
bool intersect(const Fan& one, const Fan& other) {
  for (const auto& [a, b] : one.triangles) {
    for (const auto& [c, d] : other.triangles) {
      if (triangles_intersect({one.displacement, a, b}, {other.displacement, c, d})) {
        return true;
      }
    }
  }
  return false;
}

/// Sets displacements of a given length for a corner's crack faces, such that the active triangles round them do not
/// cut through each other: inwards, or else in the first suitable direction, from those nearest to inwards on.
void find_ways(Fan* fans, std::size_t count, double length) {
  std::vector<Eigen::Vector3d> directions;
  for (int n = 0; n < 27; ++n) {
    directions.push_back(Eigen::Vector3d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1).stableNormalized());
  }
  std::vector<std::vector<Eigen::Vector3d>> ways;  // of each, from the best on
  for (std::size_t k = 0; k < count; ++k) {
    const Fan& fan = fans[k];
    const Eigen::Vector3d middle = inwards(fan);
    std::stable_sort(directions.begin(), directions.end(),
                     [&middle](const auto& a, const auto& b) { return a.dot(middle) > b.dot(middle); });
    ways.push_back({fan.is_held ? Eigen::Vector3d::Zero().eval() : Eigen::Vector3d(length * middle)});
    for (std::size_t n = 0; n < directions.size() && !fan.is_held; ++n) {
      ways.back().push_back(length * directions[n]);
    }
  }
  const auto fits = [&](std::size_t k) {
    return std::none_of(fans, fans + k, [&](const Fan& before) {
      return (fans[k].displacement - before.displacement).norm() < length / 2 || intersect(fans[k], before);
    });
  };
  const auto place = [&](std::size_t k) {
    return std::any_of(ways[k].begin(), ways[k].end(), [&](const Eigen::Vector3d& displacement) {
      fans[k].displacement = displacement;
      return fits(k);
    });
  };
  for (const Eigen::Vector3d& first : ways.front()) {
    fans[0].displacement = first;
    std::size_t k = 1;
    while (k < count && place(k)) {
      ++k;
    }
    if (k == count) {
      return;
    }
  }
  for (std::size_t k = 0; k < count; ++k) {
    fans[k].displacement = ways[k].front();
  }
}

/// Moves the crack faces of a surface as far as they are to go. Collective.
void move_lips(const CrackedSurface& cracked) {
  const Surface& surface = *cracked.part.surface;
  const std::vector<CrackFace>& crack_faces = cracked.crack_faces;
  Field& position = cracked.position;
  std::map<PetscInt, std::size_t> number;  // in `crack faces`, of each id
  for (std::size_t n = 0; n < crack_faces.size(); ++n) {
    number[crack_faces[n].id] = n;
  }
  std::vector<FanTriangle> own;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const std::array<PetscInt, 3>& triangle = surface.triangles[t];
    const std::size_t corners = surface.has_quads() ? 2 : 3;  // A quad's centre is not a corner.
    const bool lives = cracked.active == nullptr || (*cracked.active)[t];
    for (std::size_t k = 0; lives && k < corners; ++k) {
      const std::size_t particle = triangle[k];
      if (triangle[k] >= surface.particles.owned || number.count(surface.persistent_id[particle]) == 0) {
        continue;
      }
      const Triangle at = places_of_triangle(surface, position.data(), t);
      own.push_back({surface.persistent_id[particle],
                     {at[(k + 1) % 3] - at[k], at[(k + 2) % 3] - at[k]},
                     cracked.constrained[particle]});
    }
  }
  std::vector<Fan> fans(crack_faces.size());
  for (const FanTriangle& triangle : of_all_ranks(surface.comm(), own)) {
    Fan& fan = fans[number.at(triangle.id)];
    fan.triangles.push_back(triangle.others);
    fan.is_held = triangle.is_held;
  }
  const double length = lip_share * cracked.part.thickness_or_usual();
  for (std::size_t first = 0, end = 0; first < crack_faces.size(); first = end) {
    while (end < crack_faces.size() && crack_faces[end].of == crack_faces[first].of) {
      ++end;
    }
    find_ways(fans.data() + first, end - first, length);
  }
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    if (const auto crack_face = number.find(surface.persistent_id[i]); crack_face != number.end()) {
      position.vector(i) += fans[crack_face->second].displacement;
    }
  }
  position.update_ghosts();
}

}  // namespace

std::vector<CrackFace> find_crack_faces(const Surface& surface, const SplitCorners& corners) {
  std::vector<CrackFace> crack_faces;
  for (const SplitCorners::Copy& copy : corners.copies) {
    const PetscInt original = surface.persistent_id[copy.original];
    crack_faces.push_back({original, original});
    crack_faces.push_back({original, copy.id});
  }
  return without_repeats(of_all_ranks(surface.comm(), crack_faces));
}

void separate_crack_faces(const std::vector<CrackedSurface>& surfaces) {
  std::vector<ContactSurface::Part> parts;
  for (const CrackedSurface& surface : surfaces) {
    parts.push_back(surface.part);
  }
  SurfaceContact contact(parts, ContactOptions(), false);
  const JoinedLayout& joined = contact.joined();
  Field before(joined.layout(), 3);
  Field after(joined.layout(), 3);
  for (std::size_t p = 0; p < surfaces.size(); ++p) {
    const CrackedSurface& surface = surfaces[p];
    contact.set_surface(surface.constrained, surface.active, p);
    joined.put(p, surface.position, before);
    if (!surface.crack_faces.empty()) {
      move_lips(surface);
    }
    joined.put(p, surface.position, after);
  }
  contact.start_from(before, after, 1);
  for (std::size_t p = 0; p < surfaces.size(); ++p) {
    joined.take(p, after, surfaces[p].position);
  }
}

}  // namespace pellicle::contact
