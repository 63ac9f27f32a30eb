#include "world/gas_heat.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <utility>

#include "geometry/pressure_load.h"
#include "parallel/collective.h"

namespace pellicle {
inline namespace world {

void GasHeat::begin_step(const Chambers& chambers, const GasExchange& exchange, const Surface& surface,
                         const Field& position, const BurningFields& fields, double capacity, double h,
                         ChamberWalls& walls) {
  capacity_ = capacity;
  h_ = h;
  std::map<std::pair<PetscInt, int>, double> areas;
  for (std::size_t triangle = 0; triangle < surface.triangles.size(); ++triangle) {
    const int wall = chambers.of_triangle(static_cast<PetscInt>(triangle));
    if (wall < 0) {
      continue;
    }
    const auto& corners = surface.triangles[triangle];
    const double area =
        area_vector(position.vector(corners[0]), position.vector(corners[1]), position.vector(corners[2])).norm();
    for (const int side : {exchange.gas_inside(wall), exchange.gas_outside(wall)}) {
      for (const PetscInt corner : corners) {
        if (side >= 0 && chambers.heat_transfer(side) > 0 && corner < surface.particles.owned &&
            fields.mass.data()[corner] > 0) {
          areas[{corner, side}] += area / 3;
        }
      }
    }
  }
  shares_.clear();
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(chambers.count(), 2);
  for (const auto& [at, area] : areas) {
    const auto [particle, chamber] = at;
    const double bare = chambers.heat_transfer(chamber) * area;
    const double conductance = bare / (1 + h * bare / (capacity * fields.mass.data()[particle]));
    shares_.push_back({particle, chamber, conductance});
    sums(chamber, 0) += conductance;
    sums(chamber, 1) += conductance * fields.temperature.data()[particle];
  }
  sum_over_ranks(surface.comm(), sums);
  walls.conductance = sums.col(0);
  walls.temperature = (sums.col(0).array() > 0).select(sums.col(1).cwiseQuotient(sums.col(0)), walls.temperature);
  walls_ = walls;
}

std::string GasHeat::end_step(const Chambers& chambers, const Eigen::VectorXd& given, BurningFields& fields) const {
  // A row a chamber: the heat that walls and gas have received together, which should be 0, and the sum of the heat
  // that was exchanged [J].
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(given.size(), 2);
  for (const auto& [particle, chamber, conductance] : shares_) {
    double& temperature = fields.temperature.data()[particle];
    const double gas = walls_.temperature[chamber] - given[chamber] / (h_ * walls_.conductance[chamber]);
    const double heat = h_ * conductance * (gas - temperature);  // into the wall [J]
    temperature += heat / (capacity_ * fields.mass.data()[particle]);
    (heat > 0 ? fields.heat_in : fields.heat_out) += std::abs(heat);
    sums(chamber, 0) += heat;
    sums(chamber, 1) += std::abs(heat);
  }
  fields.temperature.update_ghosts();
  sum_over_ranks(chambers.surface().comm(), sums);
  constexpr double tolerance = 1e-10;
  for (Eigen::Index chamber = 0; chamber < given.size(); ++chamber) {
    const double rest = sums(chamber, 0) + given[chamber];
    if (!(std::abs(rest) <= tolerance * (sums(chamber, 1) + std::abs(given[chamber])))) {
      return fmt::format("the ledger of the heat between chamber {} and walls is off by {:.2g} J of {:.2g} J",
                         chambers.name(static_cast<int>(chamber)), rest, std::abs(given[chamber]));
    }
  }
  return "";
}

}  // namespace world
}  // namespace pellicle
