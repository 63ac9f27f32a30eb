#include "gas/rims.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "base/disjoint_sets.h"
#include "parallel/collective.h"

namespace pellicle::gas {

namespace {

/// A side by the persistent ids of its ends, its chamber, and the symmetry planes that its ends lie in.
struct NamedSide {
  PetscInt from;
  PetscInt to;
  int chamber;
  unsigned planes_of_from;
  unsigned planes_of_to;
};

/// A vertex of rims.
struct Vertex {
  int begun = 0;        ///< sides that begin here less those that end here
  unsigned planes = 0;  ///< that it lies in
  std::size_t number = 0;
  PetscInt place = -1;  ///< number of the local particle; -1: another rank's
};

/// Projector on the directions that lie in all of some planes.
Eigen::Matrix3d projector_on(unsigned planes, const std::vector<Eigen::Vector3d>& normals) {
  constexpr double nearness = 1e-6;  // normals that differ less are the same
  Eigen::Matrix3d projector = Eigen::Matrix3d::Identity();
  for (std::size_t plane = 0; plane < normals.size(); ++plane) {
    const Eigen::Vector3d axis = projector * normals[plane];
    if ((planes >> plane) % 2 == 1 && axis.norm() > nearness) {
      projector -= axis.normalized() * axis.normalized().transpose();
    }
  }
  return projector;
}

/// The sides whose opposites are not among them.
std::vector<NamedSide> without_opposites(const std::vector<NamedSide>& sides) {
  std::set<std::pair<PetscInt, PetscInt>> all;
  for (const NamedSide& side : sides) {
    all.insert({side.from, side.to});
  }
  std::vector<NamedSide> left;
  std::copy_if(sides.begin(), sides.end(), std::back_inserter(left), [&](const NamedSide& side) {
    return all.count({side.to, side.from}) == 0;
  });
  return left;
}

}  // namespace

Rims::Rims(const Surface& surface, const std::vector<int>& chamber, const Eigen::Vector3d& origin,
           const SymmetryPlanes& planes)
    : surface_(&surface), origin_(origin) {
  std::vector<NamedSide> own;
  for (PetscInt triangle = 0; triangle < surface.owned_triangles(); ++triangle) {
    for (std::size_t k = 0; k < 3 && chamber[triangle] >= 0; ++k) {
      const PetscInt from = surface.triangles[triangle][k];
      const PetscInt to = surface.triangles[triangle][(k + 1) % 3];
      if (planes.common(from, to) == 0) {
        own.push_back({surface.persistent_id[from], surface.persistent_id[to], chamber[triangle],
                       planes.common(from, from), planes.common(to, to)});
      }
    }
  }
  // The remaining sides of a rank have a neighbour on another rank, or none.
  const std::vector<NamedSide> all = without_opposites(of_all_ranks(surface.comm(), without_opposites(own)));
  if (all.empty()) {
    return;
  }
  std::map<PetscInt, Vertex> vertices;  // by persistent id
  for (const NamedSide& side : all) {
    Vertex& from = vertices[side.from];
    Vertex& to = vertices[side.to];
    from.begun += 1;
    from.planes = side.planes_of_from;
    to.begun -= 1;
    to.planes = side.planes_of_to;
  }
  std::size_t count = 0;
  for (auto& [id, vertex] : vertices) {
    vertex.number = count++;
  }
  for (PetscInt i = 0; i < surface.particles.local(); ++i) {
    if (const auto found = vertices.find(surface.persistent_id[i]); found != vertices.end()) {
      found->second.place = i;
    }
  }
  // Sides with a common end are of one rim. Rims are in the order of the lowest ids of their vertices.
  DisjointSets joined(count);
  for (const NamedSide& side : all) {
    joined.unite(vertices[side.from].number, vertices[side.to].number);
  }
  std::vector<std::size_t> rim_of;  // of the vertices by number
  std::vector<unsigned> ends_in;    // planes in which each rim ends
  for (const auto& [id, vertex] : vertices) {
    const std::size_t lowest = joined.find(vertex.number);
    rim_of.push_back(lowest == vertex.number ? ends_in.size() : rim_of[lowest]);
    ends_in.resize(std::max(ends_in.size(), rim_of.back() + 1), 0);
    ends_in[rim_of.back()] |= vertex.begun != 0 ? vertex.planes : 0;
  }
  for (const unsigned planes_of_ends : ends_in) {
    rims_.emplace_back().projector = projector_on(planes_of_ends, planes.normals);
  }
  std::set<std::pair<PetscInt, PetscInt>> ends_of_all;
  for (const NamedSide& side : all) {
    const Vertex& from = vertices[side.from];
    const Vertex& to = vertices[side.to];
    Rim& rim = rims_[rim_of[from.number]];
    rim.chamber = side.chamber;
    rim.sides += 1;
    ends_of_all.insert({from.place, to.place});
    const auto is_owned = [&](PetscInt end) { return end >= 0 && end < surface.particles.owned; };
    if (is_owned(from.place) || is_owned(to.place)) {
      sides_.push_back({{from.place, to.place}, rim_of[from.number]});
    }
  }
  for (std::size_t triangle = 0; triangle < chamber.size(); ++triangle) {
    const auto& corners = surface.triangles[triangle];
    for (std::size_t k = 0; k < 3 && chamber[triangle] >= 0; ++k) {
      if (ends_of_all.count({corners[k], corners[(k + 1) % 3]}) > 0) {
        sides_of_triangles_.push_back(static_cast<PetscInt>(3 * triangle + k));
      }
    }
  }
}

std::vector<Rims::Cap> Rims::caps(const Field& positions) const {
  std::vector<Cap> caps;
  if (empty()) {
    return caps;
  }
  // Sums about the origin: of the sides' middles, of (to x from) / 2, and of (to - from) / 2.
  Eigen::Matrix<double, 9, Eigen::Dynamic> sums =
      Eigen::Matrix<double, 9, Eigen::Dynamic>::Zero(9, static_cast<Eigen::Index>(rims_.size()));
  for (const Side& side : sides_) {
    if (side.ends[0] < surface_->particles.owned) {  // One rank has its beginning.
      const Eigen::Vector3d from = positions.vector(side.ends[0]) - origin_;
      const Eigen::Vector3d to = positions.vector(side.ends[1]) - origin_;
      auto sum = sums.col(static_cast<Eigen::Index>(side.rim));
      sum.head<3>() += (from + to) / 2;
      sum.segment<3>(3) += to.cross(from) / 2;
      sum.tail<3>() += (to - from) / 2;
    }
  }
  sum_over_ranks(surface_->comm(), sums);
  for (std::size_t rim = 0; rim < rims_.size(); ++rim) {
    const auto sum = sums.col(static_cast<Eigen::Index>(rim));
    const Eigen::Vector3d middle = rims_[rim].projector * sum.head<3>() / rims_[rim].sides;
    const Eigen::Vector3d cone = sum.segment<3>(3);
    // In the whole loop the parts across the planes cancel.
    const Eigen::Vector3d area = rims_[rim].projector * (cone + middle.cross(Eigen::Vector3d(sum.tail<3>())));
    caps.push_back({rims_[rim].chamber, origin_ + middle, area, middle.dot(cone) / 3});
  }
  return caps;
}

std::vector<Rims::Hole> Rims::holes(const Field& positions) const {
  std::vector<Hole> holes;
  if (empty()) {
    return holes;
  }
  const std::vector<Cap> all = caps(positions);
  std::vector<double> areas(all.size());
  for (const Side& side : sides_) {
    if (side.ends[0] < surface_->particles.owned) {
      const Eigen::Vector3d from = positions.vector(side.ends[0]) - all[side.rim].middle;
      const Eigen::Vector3d to = positions.vector(side.ends[1]) - all[side.rim].middle;
      areas[side.rim] += from.cross(to).norm() / 2;
    }
  }
  sum_over_ranks(surface_->comm(), areas);
  for (std::size_t rim = 0; rim < all.size(); ++rim) {
    holes.push_back({rims_[rim].chamber, areas[rim], all[rim].middle});
  }
  return holes;
}

void Rims::add_thrust(const Eigen::VectorXd& thrust, const Field& positions, Eigen::Matrix3Xd& force) const {
  const std::vector<Cap> all = caps(positions);
  for (const Side& side : sides_) {
    const Rim& rim = rims_[side.rim];
    for (const PetscInt end : side.ends) {
      if (end >= 0 && end < surface_->particles.owned) {
        force.col(end) -= thrust[rim.chamber] / (2 * rim.sides) * all[side.rim].area;
      }
    }
  }
}

}  // namespace pellicle::gas
