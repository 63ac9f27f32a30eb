#include "gas/rims.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "parallel/collective.h"

namespace pellicle {
inline namespace gas {

namespace {

/// A side by the persistent ids of its ends, its chamber, and the symmetry planes that its ends lie in.
struct NamedSide {
  PetscInt from;
  PetscInt to;
  int chamber;
  unsigned planes_of_from;
  unsigned planes_of_to;
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
  const std::size_t owned = surface.triangles_per_element * surface.elements.owned;
  for (std::size_t triangle = 0; triangle < owned; ++triangle) {
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
  // Sides with a common end are of one rim, which has the lowest id of its ends.
  std::map<PetscInt, PetscInt> lower;
  const std::function<PetscInt(PetscInt)> lowest = [&](PetscInt id) {
    PetscInt& next = lower.try_emplace(id, id).first->second;
    return next == id ? id : next = lowest(next);
  };
  for (const NamedSide& side : all) {
    const PetscInt a = lowest(side.from);
    const PetscInt b = lowest(side.to);
    lower[std::max(a, b)] = std::min(a, b);
  }
  std::map<PetscInt, std::size_t> rim_of;
  for (const NamedSide& side : all) {
    rim_of.try_emplace(lowest(side.from), 0);
  }
  std::size_t rims = 0;
  for (auto& [id, rim] : rim_of) {
    rim = rims++;
  }
  rims_.resize(rims);
  std::map<PetscInt, PetscInt> place;  // of local particles at rims
  for (const auto& [id, low] : lower) {
    place[id] = -1;
  }
  for (PetscInt i = 0; i < surface.particles.local(); ++i) {
    if (const auto found = place.find(surface.persistent_id[i]); found != place.end()) {
      found->second = i;
    }
  }
  std::set<std::pair<PetscInt, PetscInt>> ends_of_all;
  for (const NamedSide& side : all) {
    ends_of_all.insert({place.at(side.from), place.at(side.to)});
  }
  for (std::size_t triangle = 0; triangle < chamber.size(); ++triangle) {
    const auto& corners = surface.triangles[triangle];
    for (std::size_t k = 0; k < 3 && chamber[triangle] >= 0; ++k) {
      if (ends_of_all.count({corners[k], corners[(k + 1) % 3]}) > 0) {
        sides_of_triangles_.push_back(static_cast<PetscInt>(3 * triangle + k));
      }
    }
  }
  std::map<PetscInt, std::pair<int, unsigned>> begun;  // at each vertex: sides that begin less those that end; planes
  for (const NamedSide& side : all) {
    Rim& rim = rims_[rim_of.at(lowest(side.from))];
    rim.chamber = side.chamber;
    rim.sides += 1;
    begun[side.from].first += 1;
    begun[side.from].second = side.planes_of_from;
    begun[side.to].first -= 1;
    begun[side.to].second = side.planes_of_to;
    const std::array<PetscInt, 2> ends{place.at(side.from), place.at(side.to)};
    const auto is_owned = [&](PetscInt end) { return end >= 0 && end < surface.particles.owned; };
    if (is_owned(ends[0]) || is_owned(ends[1])) {
      sides_.push_back({ends, rim_of.at(lowest(side.from))});
    }
  }
  std::vector<unsigned> ends_in(rims, 0);
  for (const auto& [id, sides] : begun) {
    ends_in[rim_of.at(lowest(id))] |= sides.first != 0 ? sides.second : 0;
  }
  for (std::size_t rim = 0; rim < rims; ++rim) {
    rims_[rim].projector = projector_on(ends_in[rim], planes.normals);
  }
}

/// The cap of each rim. Collective.
std::vector<Rims::Cap> Rims::caps(const Field& positions) const {
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
  std::vector<Cap> caps;
  for (std::size_t rim = 0; rim < rims_.size(); ++rim) {
    const auto sum = sums.col(static_cast<Eigen::Index>(rim));
    const Eigen::Vector3d middle = rims_[rim].projector * sum.head<3>() / rims_[rim].sides;
    const Eigen::Vector3d cone = sum.segment<3>(3);
    // In the whole loop the parts across the planes cancel.
    const Eigen::Vector3d area = rims_[rim].projector * (cone + middle.cross(Eigen::Vector3d(sum.tail<3>())));
    caps.push_back({origin_ + middle, area, middle.dot(cone) / 3});
  }
  return caps;
}

void Rims::add_volumes(const Field& positions, Eigen::VectorXd& volumes) const {
  if (empty()) {
    return;
  }
  const std::vector<Cap> all = caps(positions);
  for (std::size_t rim = 0; rim < all.size(); ++rim) {
    volumes[rims_[rim].chamber] += all[rim].volume;
  }
}

std::vector<Rims::Hole> Rims::holes(const Field& positions) const {
  std::vector<Hole> holes;
  if (empty()) {
    return holes;
  }
  const std::vector<Cap> all = caps(positions);
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(all.size()));
  for (const Side& side : sides_) {
    if (side.ends[0] < surface_->particles.owned) {
      const Eigen::Vector3d from = positions.vector(side.ends[0]) - all[side.rim].middle;
      const Eigen::Vector3d to = positions.vector(side.ends[1]) - all[side.rim].middle;
      areas[static_cast<Eigen::Index>(side.rim)] += from.cross(to).norm() / 2;
    }
  }
  sum_over_ranks(surface_->comm(), areas);
  for (std::size_t rim = 0; rim < all.size(); ++rim) {
    holes.push_back({rims_[rim].chamber, areas[static_cast<Eigen::Index>(rim)], all[rim].middle});
  }
  return holes;
}

void Rims::add_thrust(const Eigen::VectorXd& thrust, const Field& positions, Eigen::Matrix3Xd& force) const {
  if (empty()) {
    return;
  }
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

}  // namespace gas
}  // namespace pellicle
