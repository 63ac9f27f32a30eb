#include "world/pressure_impulse.h"

#include "parallel/collective.h"

namespace pellicle::world {

PressureImpulse::PressureImpulse(GasCoupling& gas, const Sheet& sheet, const Field& free,
                                 const std::vector<double>& mass, const std::vector<bool>& constrained, double h)
    : gas_(gas),
      chambers_(gas.chambers()),
      response_{chambers_.volumes(free), Eigen::VectorXd(chambers_.count())},
      pressure_(chambers_.count()),
      velocity_(sheet.particles, 3) {
  const PetscInt owned = sheet.particles.owned;
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    Field& move = moves_.emplace_back(sheet.particles, 3);
    move.values().leftCols(owned) = chambers_.volume_gradient(chamber, free);
    if (sheet.layers == 1) {
      move.update_ghosts();
      for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
        for (const PetscInt corner : sheet.cells[cell]) {
          move.vector(corner) += move.vector(sheet.lattice[cell]) / 4;
        }
      }
    }
    double sum = 0;
    for (PetscInt i = 0; i < owned; ++i) {
      const Eigen::Vector3d gradient = move.vector(i);
      move.vector(i) *= constrained[i] ? 0 : h / mass[i];
      sum += h * gradient.dot(move.vector(i));
    }
    move.update_ghosts();
    response_.compliance[chamber] = sum_over_ranks(sheet.comm(), sum);
  }
  gas_.gas().set_response(gas_.number(), response_);
}

void PressureImpulse::choose_pressures() {
  velocity_.values().setZero();
  const Eigen::VectorXd& walls = gas_.gas().walls(gas_.number());
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    const double compliance = response_.compliance[chamber];
    if (!chambers_.prescribes_volume(chamber)) {
      pressure_[chamber] = gas_.gas().states(gas_.number())[chamber].pressure;
    } else {
      pressure_[chamber] = compliance > 0 ? (walls[chamber] - response_.walls[chamber]) / compliance : 0;
    }
    velocity_.values() += pressure_[chamber] * moves_[chamber].values();
  }
}

bool PressureImpulse::fix(const Field& end) {
  constexpr double negligible = 1e-9;  // of a volume
  const Eigen::VectorXd walls = chambers_.volumes(end);
  const bool has_moved =
      !is_fixed_ || ((walls - response_.walls).array().abs() > negligible * walls.array().abs()).any();
  is_fixed_ = true;
  response_.walls = walls;
  response_.compliance.setZero();
  gas_.gas().set_response(gas_.number(), response_);
  return has_moved;
}

}  // namespace pellicle::world
