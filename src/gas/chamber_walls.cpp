#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/sorting.h"
#include "gas/chambers.h"
#include "geometry/pi.h"
#include "geometry/pressure_load.h"
#include "parallel/collective.h"

namespace pellicle::gas {

namespace {

/// The sums of a quantity of the owned triangles' three corners by numbers of the triangles, over all ranks.
/// Collective. @param number of each local triangle, below the count, -1: none
template <class Quantity>
Eigen::VectorXd sum_over_triangles(const Surface& surface, const Field& positions, const std::vector<int>& number,
                                   int count, Quantity quantity) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count);
  for (PetscInt triangle = 0; triangle < surface.owned_triangles(); ++triangle) {
    if (number[triangle] >= 0) {
      const auto& [a, b, c] = surface.triangles[triangle];
      sum[number[triangle]] += quantity(positions.vector(a), positions.vector(b), positions.vector(c));
    }
  }
  sum_over_ranks(surface.comm(), sum);
  return sum;
}

/// Force of the jet on the surface that it leaves, over the area times the discharge coefficient: the momentum of the
/// flow and, where it is choked, the excess of its pressure over that outside [Pa]. 0 if nothing flows out.
/// @param upstream absolute pressure [Pa] @param downstream absolute pressure [Pa] @param gamma ratio of the heat
/// capacities
double jet_thrust(double upstream, double downstream, double gamma) {
  if (!(upstream > downstream)) {
    return 0;
  }
  const double choked = std::pow(2 / (gamma + 1), gamma / (gamma - 1));
  const double outlet = std::max(downstream, choked * upstream);
  const double squared_mach = 2 / (gamma - 1) * std::expm1((gamma - 1) / gamma * std::log(upstream / outlet));
  return gamma * outlet * squared_mach + outlet - downstream;
}

}  // namespace

void Chambers::set_active(const ActiveSet& active) {
  const std::vector<int> before = std::exchange(chamber_of_triangle_, std::vector<int>(active.triangles.size(), -1));
  std::vector<int> venting(active.triangles.size(), -1);
  has_hole_.assign(chambers_.size(), 0);
  const auto open = [this](PetscInt chamber) {
    if (chamber >= 0 && !needs_volume(static_cast<int>(chamber))) {
      has_hole_[chamber] = 1;
    }
  };
  for (std::size_t triangle = 0; triangle < active.triangles.size(); ++triangle) {
    const auto chamber = static_cast<int>(chamber_of_element_[surface_->element_of_triangle(triangle)]);
    if (chamber >= 0 && (active.triangles[triangle] || needs_closed_wall(chamber))) {
      chamber_of_triangle_[triangle] = chamber;
      venting[triangle] = vents(chamber) ? chamber : -1;
    } else {
      open(chamber);
    }
  }
  for (std::size_t side = 0; side < active.cracked.size(); ++side) {
    if (active.cracked[side]) {
      open(chamber_of_element_[surface_->element_of_side(side)]);
    }
  }
  max_over_ranks(surface_->comm(), has_hole_);
  if (before != chamber_of_triangle_ || before.empty()) {
    make_gradient_pattern();
  }
  const bool can_vent = std::any_of(chambers_.begin(), chambers_.end(),
                                    [](const Chamber& chamber) { return chamber.options.hole_discharge.has_value(); });
  if (can_vent && on_any_rank(surface_->comm(), before != chamber_of_triangle_)) {
    rims_ = Rims(*surface_, venting, origin_, planes_);
  }
}

/// Makes the pattern of volume_gradients after a change of chamber_of_triangle_.
void Chambers::make_gradient_pattern() {
  std::vector<std::pair<int, PetscInt>> pairs;  // chamber and particle
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    for (const PetscInt corner : surface_->triangles[triangle]) {
      if (chamber_of_triangle_[triangle] >= 0 && corner < surface_->particles.owned) {
        pairs.emplace_back(chamber_of_triangle_[triangle], corner);
      }
    }
  }
  pairs = without_repeats(std::move(pairs));
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& [chamber, particle] : pairs) {
    for (int k = 0; k < 3; ++k) {
      entries.emplace_back(3 * particle + k, chamber, 0);
    }
  }
  no_gradients_ = Eigen::SparseMatrix<double>(3 * surface_->particles.owned, count());
  no_gradients_.setFromTriplets(entries.begin(), entries.end());
  place_of_corner_.clear();
  if (count() == 0) {
    return;
  }
  place_of_corner_.reserve(3 * surface_->triangles.size());
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    const int chamber = chamber_of_triangle_[triangle];
    for (const PetscInt corner : surface_->triangles[triangle]) {
      const bool counts = chamber >= 0 && corner < surface_->particles.owned;
      const auto place = std::lower_bound(pairs.begin(), pairs.end(), std::pair(chamber, corner)) - pairs.begin();
      place_of_corner_.push_back(counts ? static_cast<PetscInt>(place) : -1);
    }
  }
}

void Chambers::require_closed(int chamber, const Field& rest, const Projectors& projectors) const {
  // The triangles that close the piece join the edges of its boundary to the origin. They lie in the planes if they
  // contribute nothing to the derivative of the volume by any vertex, within its planes.
  Eigen::Matrix3Xd closing = -volume_gradient(chamber, rest);
  double scale = 0;
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    if (chamber_of_triangle_[triangle] != chamber) {
      continue;
    }
    const auto& corners = surface_->triangles[triangle];
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d second = rest.vector(corners[(k + 1) % 3]) - origin_;
      const Eigen::Vector3d third = rest.vector(corners[(k + 2) % 3]) - origin_;
      const Eigen::Vector3d fraction = second.cross(third) / 6;
      scale = std::max(scale, fraction.norm());
      if (corners[k] < surface_->particles.owned) {
        closing.col(corners[k]) += fraction;
      }
    }
  }
  scale = max_over_ranks(surface_->comm(), scale);
  constexpr double tolerance = 1e-5;  // a vertex counts as one in the plane a little off it
  constexpr PetscInt none = std::numeric_limits<PetscInt>::max();
  PetscInt open = none;
  for (PetscInt i = 0; i < surface_->particles.owned; ++i) {
    if ((projectors[i] * closing.col(i)).norm() > tolerance * scale) {
      open = std::min(open, surface_->persistent_id[i]);
    }
  }
  open = min_over_ranks(surface_->comm(), open);
  if (open != none) {
    throw Error("chambers." + of(chamber).name + ".law: " + of(chamber).options.law.name() +
                " needs a volume, but the piece is open at vertex " + std::to_string(open) +
                ", expected its whole boundary in symmetry planes, or the law pressure");
  }
}

/// Volumes that triangles and rims enclose [m^3]. Collective. @param chamber_of_triangle below the count, -1: none
Eigen::VectorXd Chambers::volumes(const Field& positions, const std::vector<int>& chamber_of_triangle, const Rims& rims,
                                  int count) const {
  Eigen::VectorXd sum = sum_over_triangles(*surface_, positions, chamber_of_triangle, count,
                                           [this](const auto& a, const auto& b, const auto& c) {
                                             return enclosed_volume(a - origin_, b - origin_, c - origin_);
                                           });
  for (const Rims::Cap& cap : rims.caps(positions)) {
    sum[cap.chamber] += cap.volume;
  }
  return sum;
}

Eigen::Matrix3Xd Chambers::volume_gradient(int chamber, const Field& positions) const {
  const Eigen::VectorXd gradient = volume_gradients(positions, chamber).col(chamber);
  return gradient.reshaped(3, surface_->particles.owned);
}

Eigen::SparseMatrix<double> Chambers::volume_gradients(const Field& positions, int only) const {
  Eigen::SparseMatrix<double> gradients = no_gradients_;
  Eigen::Map<Eigen::Matrix3Xd> values(gradients.valuePtr(), 3, gradients.nonZeros() / 3);
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    const int chamber = chamber_of_triangle_[triangle];
    if (chamber < 0 || (only >= 0 && chamber != only)) {
      continue;
    }
    const auto& corners = surface_->triangles[triangle];
    const Eigen::Vector3d third =
        area_vector(positions.vector(corners[0]), positions.vector(corners[1]), positions.vector(corners[2])) / 3;
    for (std::size_t k = 0; k < 3; ++k) {
      if (const PetscInt place = place_of_corner_[3 * triangle + k]; place >= 0) {
        values.col(place) += third;
      }
    }
  }
  return gradients;
}

/// Winding numbers of surfaces round the middle of a chamber's wall; 1: the chamber is inside a closed surface.
/// Collective. @param number_of_triangle the surface of each local triangle, below the count, -1: none
Eigen::VectorXd Chambers::windings(int chamber, const Field& positions, const std::vector<int>& number_of_triangle,
                                   int count) const {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();  // of places, of how many
  for (PetscInt triangle = 0; triangle < surface_->owned_triangles(); ++triangle) {
    if (chamber_of_triangle_[triangle] == chamber) {
      for (const PetscInt corner : surface_->triangles[triangle]) {
        sum.head<3>() += positions.vector(corner);
        sum[3] += 1;
      }
    }
  }
  sum_over_ranks(surface_->comm(), sum);
  const Eigen::Vector3d middle = sum.head<3>() / std::max(sum[3], 1.0);
  return sum_over_triangles(*surface_, positions, number_of_triangle, count,
                            [&middle](const auto& a, const auto& b, const auto& c) {
                              return solid_angle(a - middle, b - middle, c - middle) / (4 * pi);
                            });
}

ChamberWalls Chambers::walls(const GasExchange& exchange, const Field& positions, const Eigen::Vector3d& gravity,
                             double time) const {
  const Eigen::VectorXd area =
      sum_over_triangles(*surface_, positions, chamber_of_triangle_, count(),
                         [](const auto& a, const auto& b, const auto& c) { return area_vector(a, b, c).norm(); });
  Eigen::VectorXd hole_area = Eigen::VectorXd::Zero(count());
  const std::vector<Rims::Hole> holes = rims_.holes(positions);
  for (const Rims::Hole& hole : holes) {
    hole_area[hole.chamber] += hole.area;
  }
  ChamberWalls result{area, hole_area, {}, Eigen::VectorXd::Zero(count()), Eigen::VectorXd(count())};
  for (int wall = 0; wall < count(); ++wall) {
    const ChamberOptions& options = of(wall).options;
    result.temperature[wall] = options.wall_temperature;
    const int inside = exchange.gas_inside(wall);
    const int outside = exchange.gas_outside(wall);
    for (const int side : {inside, outside}) {
      if (side >= 0) {
        result.conductance[side] += heat_transfer(side) * area[wall];
      }
    }
    if (options.permeability > 0 && inside != outside) {
      result.leaks.push_back({inside, options.permeability * area[wall], 0, outside});
    }
  }
  if (!holes.empty()) {
    const std::vector<UnevenPressure> uneven = uneven_pressures(exchange, positions, gravity, time);
    for (const Rims::Hole& hole : holes) {
      const int inside = exchange.gas_inside(hole.chamber);
      const int outside = exchange.gas_outside(hole.chamber);
      if (inside != outside) {
        result.leaks.push_back({inside, of(hole.chamber).options.hole_discharge.value_or(0) * hole.area,
                                uneven[hole.chamber].at(hole.middle), outside});
      }
    }
  }
  return result;
}

/// The uneven pressure of each chamber. Collective.
std::vector<Chambers::UnevenPressure> Chambers::uneven_pressures(const GasExchange& exchange, const Field& positions,
                                                                 const Eigen::Vector3d& gravity, double time) const {
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(4, count());  // area, area times place
  for (PetscInt triangle = 0; triangle < surface_->owned_triangles(); ++triangle) {
    if (const int chamber = of_triangle(triangle); chamber >= 0) {
      const auto& corners = surface_->triangles[triangle];
      const Eigen::Vector3d x[3] = {positions.vector(corners[0]), positions.vector(corners[1]),
                                    positions.vector(corners[2])};
      const double area = area_vector(x[0], x[1], x[2]).norm();
      sums(0, chamber) += area;
      sums.col(chamber).tail<3>() += area / 3 * (x[0] + x[1] + x[2]);
    }
  }
  sum_over_ranks(surface_->comm(), sums);
  const double of_air = gas_.ambient_pressure * gas_.molar_mass / (gas_constant * gas_.ambient_temperature);
  const Eigen::VectorXd volume = exchange.gas_volumes(volumes(positions));
  Eigen::VectorXd density(count());
  for (int chamber = 0; chamber < count(); ++chamber) {
    const GasState gas = state(exchange, chamber, volume[chamber], time);
    const bool has_amount = gas.amount > 0 && volume[chamber] > 0 && !exchange.is_open(chamber);
    density[chamber] = has_amount ? gas.amount * gas_.molar_mass / volume[chamber] : of_air;
  }
  std::vector<UnevenPressure> result;
  for (int wall = 0; wall < count(); ++wall) {
    const int outside = exchange.gas_outside(wall);
    const double round = outside >= 0 ? density[outside] : of_air;
    result.push_back(
        {(density[exchange.gas_inside(wall)] - round) * gravity, sums.col(wall).tail<3>() / sums(0, wall)});
  }
  return result;
}

Eigen::Matrix3Xd Chambers::uneven_forces(const GasExchange& exchange, const Field& positions,
                                         const Eigen::Vector3d& gravity, double time) const {
  const std::vector<UnevenPressure> uneven = uneven_pressures(exchange, positions, gravity, time);
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, surface_->particles.owned);
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    const int chamber = chamber_of_triangle_[triangle];
    if (chamber < 0) {
      continue;
    }
    const auto& corners = surface_->triangles[triangle];
    const Eigen::Vector3d x[3] = {positions.vector(corners[0]), positions.vector(corners[1]),
                                  positions.vector(corners[2])};
    const Eigen::Vector3d area = area_vector(x[0], x[1], x[2]);
    for (std::size_t k = 0; k < 3; ++k) {
      if (corners[k] < surface_->particles.owned) {  // a linear pressure times the corner's share
        const Eigen::Vector3d place = (x[0] + x[1] + x[2] + x[k]) / 4;
        force.col(corners[k]) += uneven[chamber].at(place) / 3 * area;
      }
    }
  }
  const std::vector<GasState> gas = states(exchange, volumes(positions), time);
  Eigen::VectorXd thrust = Eigen::VectorXd::Zero(count());
  for (int wall = 0; wall < count(); ++wall) {
    if (vents(wall)) {  // But for what the missing wall does not bear.
      const double within = gas[exchange.gas_inside(wall)].absolute_pressure;
      const double jet = jet_thrust(within, within - gas[wall].pressure, of(wall).gamma);
      thrust[wall] = of(wall).options.hole_discharge.value_or(0) * jet - gas[wall].pressure;
    }
  }
  rims_.add_thrust(thrust, positions, force);
  return force;
}

}  // namespace pellicle::gas
