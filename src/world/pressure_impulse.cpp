#include "world/pressure_impulse.h"

#include <memory>

#include "parallel/collective.h"

namespace pellicle::world {

PressureImpulse::PressureImpulse(const Sheet& sheet, const Chambers& chambers, const GasStep& gas_step,
                                 const Field& start)
    : sheet_(sheet),
      chambers_(chambers),
      gas_step_(gas_step),
      start_(start),
      end_(sheet.particles, 3),
      pressure_(chambers.count()),
      velocity_(sheet.particles, 3) {
  for (int chamber = 0; chamber < chambers.count(); ++chamber) {
    moves_.emplace_back(sheet.particles, 3);
  }
  gas_ = std::make_shared<StepGas>(std::vector<StepGas::Part>{gas_part()});
}

void PressureImpulse::begin_step(double time, double h, const Field& free, const std::vector<double>& mass,
                                 const std::vector<bool>& constrained) {
  time_ = time;
  h_ = h;
  is_fixed_ = false;
  gas_->begin_step(time);
  response_ = {chambers_.volumes(free), Eigen::VectorXd(chambers_.count())};
  const PetscInt owned = sheet_.particles.owned;
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    Field& move = moves_[chamber];
    move.values().leftCols(owned) = chambers_.volume_gradient(chamber, free);
    if (sheet_.layers == 1) {
      move.update_ghosts();
      for (std::size_t cell = 0; cell < sheet_.cells.size(); ++cell) {
        for (const PetscInt corner : sheet_.cells[cell]) {
          move.vector(corner) += move.vector(sheet_.lattice[cell]) / 4;
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
    response_.compliance[chamber] = sum_over_ranks(sheet_.comm(), sum);
  }
  gas_->set_response(number_, response_);
}

void PressureImpulse::choose_pressures() {
  velocity_.values().setZero();
  const Eigen::VectorXd& walls = gas_->walls(number_);
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    const double compliance = response_.compliance[chamber];
    if (!chambers_.prescribes_volume(chamber)) {
      pressure_[chamber] = gas_->states(number_)[chamber].pressure;
    } else {
      pressure_[chamber] = compliance > 0 ? (walls[chamber] - response_.walls[chamber]) / compliance : 0;
    }
    velocity_.values() += pressure_[chamber] * moves_[chamber].values();
  }
}

bool PressureImpulse::fix(const Field& end) {
  constexpr double negligible = 1e-9;  // of a volume
  end_.values() = end.values();
  const Eigen::VectorXd walls = chambers_.volumes(end);
  const bool has_moved =
      !is_fixed_ || ((walls - response_.walls).array().abs() > negligible * walls.array().abs()).any();
  is_fixed_ = true;
  response_.walls = walls;
  response_.compliance.setZero();
  gas_->set_response(number_, response_);
  return has_moved;
}

}  // namespace pellicle::world
