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

/// A side by the persistent ids of its ends, and its chamber.
struct NamedSide {
  PetscInt from;
  PetscInt to;
  int chamber;
};

/// Those of the sides that are not there the other way round, too.
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

Rims::Rims(const Surface& surface, const std::vector<int>& chamber) : surface_(&surface) {
  std::vector<NamedSide> own;
  const auto owned = static_cast<std::size_t>(surface.triangles_per_element * surface.elements.owned);
  for (std::size_t triangle = 0; triangle < owned; ++triangle) {
    for (std::size_t k = 0; k < 3 && chamber[triangle] >= 0; ++k) {
      const auto id = [&](std::size_t corner) {
        return surface.persistent_id[static_cast<std::size_t>(surface.triangles[triangle][corner % 3])];
      };
      own.push_back({id(k), id(k + 1), chamber[triangle]});
    }
  }
  // What is left on a rank has a neighbour on another one, or none.
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
  chamber_.resize(rims);
  sides_of_.assign(rims, 0);
  std::map<PetscInt, PetscInt> place;  // of local particles at rims
  for (const auto& [id, low] : lower) {
    place[id] = -1;
  }
  for (PetscInt i = 0; i < surface.particles.local(); ++i) {
    if (const auto found = place.find(surface.persistent_id[static_cast<std::size_t>(i)]); found != place.end()) {
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
  for (const NamedSide& side : all) {
    const std::size_t rim = rim_of.at(lowest(side.from));
    chamber_[rim] = side.chamber;
    sides_of_[rim] += 1;
    const std::array<PetscInt, 2> ends{place.at(side.from), place.at(side.to)};
    const auto is_owned = [&](PetscInt end) { return end >= 0 && end < surface.particles.owned; };
    if (is_owned(ends[0]) || is_owned(ends[1])) {
      sides_.push_back({ends, rim});
    }
  }
}

/// Collective.
std::vector<Rims::Cap> Rims::caps(const Field& positions) const {
  Eigen::Matrix<double, 6, Eigen::Dynamic> sums =
      Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, static_cast<Eigen::Index>(chamber_.size()));
  for (const Side& side : sides_) {
    if (side.ends[0] < surface_->particles.owned) {  // One rank has its beginning.
      const Eigen::Vector3d from = positions.vector(side.ends[0]);
      const Eigen::Vector3d to = positions.vector(side.ends[1]);
      sums.col(static_cast<Eigen::Index>(side.rim)).head<3>() += from / sides_of_[side.rim];
      sums.col(static_cast<Eigen::Index>(side.rim)).tail<3>() -= from.cross(to) / 2;
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, surface_->comm());
  std::vector<Cap> caps;
  for (Eigen::Index rim = 0; rim < sums.cols(); ++rim) {
    caps.push_back({sums.col(rim).head<3>(), sums.col(rim).tail<3>()});
  }
  return caps;
}

void Rims::add_volumes(const Field& positions, const Eigen::Vector3d& origin, Eigen::VectorXd& volumes) const {
  if (empty()) {
    return;
  }
  const std::vector<Cap> all = caps(positions);
  for (std::size_t rim = 0; rim < all.size(); ++rim) {
    volumes[chamber_[rim]] += (all[rim].middle - origin).dot(all[rim].area) / 3;
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
  MPI_Allreduce(MPI_IN_PLACE, areas.data(), static_cast<int>(areas.size()), MPI_DOUBLE, MPI_SUM, surface_->comm());
  for (std::size_t rim = 0; rim < all.size(); ++rim) {
    holes.push_back({chamber_[rim], areas[static_cast<Eigen::Index>(rim)], all[rim].middle});
  }
  return holes;
}

void Rims::add_thrust(const Eigen::VectorXd& thrust, const Field& positions, Eigen::Matrix3Xd& force) const {
  if (empty()) {
    return;
  }
  const std::vector<Cap> all = caps(positions);
  for (const Side& side : sides_) {
    if (side.ends[0] < surface_->particles.owned) {
      force.col(side.ends[0]) -= thrust[chamber_[side.rim]] / sides_of_[side.rim] * all[side.rim].area;
    }
  }
}

}  // namespace gas
}  // namespace pellicle
