#include "equilibrium/gas_filled_part.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/cross_matrix.h"
#include "geometry/pressure_load.h"
#include "prism/wall_potential.h"

namespace pellicle::equilibrium {

std::vector<VertexPair> PressureStiffness::pattern() const { return pairs_of_elements(chambers_.surface()); }

void PressureStiffness::update_hessian(const Field& x, double psd_blend) {
  blocks_.clear();
  const double fraction = 1 - psd_blend;
  if (pressure_.empty() || fraction == 0) {
    return;
  }
  const auto& triangles = chambers_.surface().triangles;
  blocks_.resize(9 * triangles.size(), Eigen::Matrix3d::Zero());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Eigen::Vector3d side = x.vector(triangles[t][1]) - x.vector(triangles[t][0]);
    const Eigen::Vector3d other = x.vector(triangles[t][2]) - x.vector(triangles[t][0]);
    const double sixth = fraction * pressure_[t] / 6;
    const std::array<Eigen::Matrix3d, 3> by_corner{cross_matrix(sixth * (side - other)), cross_matrix(sixth * other),
                                                   cross_matrix(-sixth * side)};
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column) {
        blocks_[9 * t + 3 * row + column] = by_corner[column];
      }
    }
  }
  for (const PetscInt rim : chambers_.rims().sides()) {
    const auto t = static_cast<std::size_t>(rim / 3);
    const auto from = static_cast<std::size_t>(rim % 3);
    const std::size_t to = (from + 1) % 3;
    const Eigen::Matrix3d block =
        rim_stiffness(fraction * pressure_[t], x.vector(triangles[t][from]), x.vector(triangles[t][to]));
    blocks_[9 * t + 3 * from + to] += block;
    blocks_[9 * t + 3 * to + from] += block;
    blocks_[9 * t + 4 * from] += 2 * block;
    blocks_[9 * t + 4 * to] += 2 * block;
  }
}

void PressureStiffness::add_hessian(const HessianBlocks& blocks) const {
  for (std::size_t pair = 0; pair < blocks_.size(); ++pair) {
    blocks.add(pair, blocks_[pair]);
  }
}

GasFilledPart::GasFilledPart(StepPart& part, StepGas::Part gas, SetLoad set_load)
    : ExtendedPart(part), own_(std::move(gas)), set_load_(std::move(set_load)), stiffness_(*own_.chambers) {
  own_.position = &part.position();
  own_.force_scale = part.force_scale();
  gas_ = std::make_shared<StepGas>(std::vector<StepGas::Part>{own_});
  if (!set_load_) {
    potentials_.push_back(&stiffness_);
    set_load_ = [this](std::vector<double> pressure) { stiffness_.set_pressure(std::move(pressure)); };
  }
}

Eigen::Matrix3Xd GasFilledPart::forces_at(double time) {
  GasStep still = *own_.step;
  still.h = 0;
  StepGas::Part own = own_;
  own.step = &still;
  StepGas gas({own});
  gas.begin_step(time);
  return -gas.gradient(0);
}

void GasFilledPart::begin_step(const Eigen::VectorXd& pressure, double time_of_balance, double time, double h) {
  time_ = time;
  h_ = h;
  gas_->begin_step(time_of_balance);
  gas_->set_multiplier(number_, pressure(prescribed()));
  gas_->balance(number_, *this);
}

Eigen::VectorXd GasFilledPart::pressures() {
  Eigen::VectorXd pressures(columns());
  std::transform(gas_->states(number_).begin(), gas_->states(number_).end(), pressures.begin(),
                 [](const GasState& state) { return state.pressure; });
  return pressures;
}

bool GasFilledPart::move_to(const Field& position, const Eigen::VectorXd& own) {
  const bool moves = part_.move_to(position, {});
  if (moves) {
    gas_->move();
  }
  gas_->set_multiplier(number_, own.cwiseProduct(pressure_scales()));
  return moves;
}

const Eigen::Matrix3Xd& GasFilledPart::gradient() {
  gradient_ = part_.gradient();
  squares_ = part_.squared_forces();
  Eigen::Matrix3Xd of_gas = gas_->gradient(number_);
  projectors().apply(of_gas);
  squares_.push_back(of_gas.squaredNorm());
  gradient_ += of_gas;
  return gradient_;
}

void GasFilledPart::begin_tangent(double psd_blend) {
  part_.begin_tangent(psd_blend);
  set_load_(gas_->load_pressure(number_));
  left_ = 1 - psd_blend;
}

double GasFilledPart::stiffness_scale() {
  double scale = part_.stiffness_scale();
  for (const GasState& gas : gas_->states(number_)) {
    scale += std::abs(gas.pressure) * std::cbrt(std::abs(gas.volume));
  }
  return scale;
}

}  // namespace pellicle::equilibrium
