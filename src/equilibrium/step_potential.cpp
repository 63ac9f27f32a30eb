#include "equilibrium/step_potential.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace pellicle {

namespace {

double sum_over_ranks(MPI_Comm comm, double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, comm);
  return value;
}

/// Share of dV/dx dV/dx^T dp/dV that a tangent takes: the paper's 1/27 is a third of the exact 1/9 (eq. 16).
double rank_one_share(GasTangent gas_tangent) { return gas_tangent == GasTangent::paper ? 1.0 / 3 : 1.0; }

}  // namespace

StepPotential::StepPotential(const BalloonModel& model, const PrismOptions& options)
    : model_(model),
      options_(options),
      tangent_(model.elements, options, model.constraints.projectors()),
      start_(model.elements.membrane().particles, 3),
      position_(model.elements.membrane().particles, 3),
      displacement_(model.elements.membrane().particles, 3),
      predicted_(3, owned()) {
  const Membrane& membrane = model_.elements.membrane();
  MPI_Comm_rank(comm(), &rank_);
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    if (model_.chambers.prescribes_volume(chamber)) {
      prescribed_.push_back(chamber);
    }
  }
  multiplier_.setZero(static_cast<Eigen::Index>(prescribed_.size()));
  gas_.resize(static_cast<std::size_t>(model_.chambers.count()));

  // The energy of the wall half as long again, over the square root of its area: what its forces are like. Taken from a
  // small stretch, since not every material can go that far.
  constexpr double strain = 1e-3;
  double sums[2] = {0, 0};
  for (std::size_t e = 0; e < static_cast<std::size_t>(membrane.elements.owned); ++e) {
    sums[0] += model_.elements.wall().rest[e].area;
  }
  position_.values() = (1 + strain) * membrane.rest;
  sums[1] = model_.elements.energy(position_, std::vector<double>(membrane.triangles.size(), 1.0));
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, comm());
  length_scale_ = std::sqrt(sums[0]);
  force_scale_ = sums[1] * std::pow(0.5 / strain, 2) / length_scale_;
}

void StepPotential::begin_step(const Field& position, const Eigen::VectorXd& pressure, const StepStart& start) {
  h_ = start.h;
  time_end_ = start.time + start.h;
  thickness_ratio_ = start.thickness_ratio;
  start_.values() = position.values();
  model_.loads.begin_step(start_, time_end_, h_);
  if (options_.stiffness_damping > 0) {
    tangent_.lag(start_, thickness_ratio_);
  }
  const std::vector<Eigen::Matrix3d>& projectors = model_.constraints.projectors();
  const auto start_from = [&](double share) {
    for (PetscInt i = 0; i < position_.values().cols(); ++i) {
      position_.vector(i) =
          start_.vector(i) + share * h_ * (projectors[static_cast<std::size_t>(i)] * start.velocity.vector(i));
    }
    model_.pins.impose(position_, time_end_);
  };
  start_from(1);
  predicted_ = position_.values().leftCols(owned());
  if (inverted() > 0 || !std::isfinite(sum_over_ranks(comm(), model_.elements.energy(position_, thickness_ratio_)))) {
    start_from(0);
  }
  multiplier_ = pressure(prescribed_);
}

void StepPotential::write_to(Vec unknowns) const {
  double* values = nullptr;
  check(VecGetArray(unknowns, &values));
  std::copy_n(position_.data(), 3 * owned(), values);
  if (rank_ == 0) {
    const Eigen::VectorXd scaled = multiplier_.cwiseQuotient(pressure_scales());
    std::copy(scaled.begin(), scaled.end(), values + 3 * owned());
  }
  check(VecRestoreArray(unknowns, &values));
}

void StepPotential::move_to(Vec unknowns) {
  const double* values = nullptr;
  check(VecGetArrayRead(unknowns, &values));
  std::copy_n(values, 3 * owned(), position_.data());
  if (rank_ == 0) {
    const Eigen::Map<const Eigen::VectorXd> scaled(values + 3 * owned(), multiplier_.size());
    multiplier_ = scaled.cwiseProduct(pressure_scales());
  }
  check(VecRestoreArrayRead(unknowns, &values));
  if (!prescribed_.empty()) {
    MPI_Bcast(multiplier_.data(), static_cast<int>(multiplier_.size()), MPI_DOUBLE, 0, comm());
  }
  position_.update_ghosts();
}

Eigen::VectorXd StepPotential::pressure_scales() const {
  Eigen::VectorXd scales(prescribed_.size());
  std::transform(prescribed_.begin(), prescribed_.end(), scales.begin(),
                 [this](int chamber) { return force_scale_ / model_.chambers.initial_volume(chamber); });
  return scales;
}

Eigen::VectorXd StepPotential::excess_volume() const {
  Eigen::VectorXd excess(prescribed_.size());
  std::transform(prescribed_.begin(), prescribed_.end(), excess.begin(), [this](int chamber) {
    return volumes_[chamber] - model_.chambers.prescribed_volume(chamber, time_end_);
  });
  return excess;
}

double StepPotential::inverted() const {
  return sum_over_ranks(comm(), static_cast<double>(model_.elements.inverted(start_, position_)));
}

void StepPotential::evaluate_gas() {
  volumes_ = model_.chambers.volumes(position_);
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    gas_[static_cast<std::size_t>(chamber)] = model_.chambers.state(chamber, volumes_[chamber], time_end_);
  }
  for (std::size_t c = 0; c < prescribed_.size(); ++c) {
    gas_[static_cast<std::size_t>(prescribed_[c])].pressure = multiplier_[static_cast<Eigen::Index>(c)];
  }
}

void StepPotential::compute_residual(Vec residual) {
  evaluate_gas();
  Eigen::Matrix3Xd wall = Eigen::Matrix3Xd::Zero(3, owned());
  Eigen::Matrix3Xd gas = Eigen::Matrix3Xd::Zero(3, owned());
  Eigen::Matrix3Xd damping = Eigen::Matrix3Xd::Zero(3, owned());
  model_.elements.add_force(position_, thickness_ratio_, wall);
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    gas += gas_[static_cast<std::size_t>(chamber)].pressure * model_.chambers.volume_gradient(chamber, position_);
  }
  if (options_.stiffness_damping > 0) {
    displacement_.values() = position_.values() - start_.values();
    tangent_.add_lagged_product(-options_.stiffness_damping / h_, displacement_, damping);
  }
  squared_forces_.fill(0);
  double* values = nullptr;
  check(VecGetArray(residual, &values));
  for (PetscInt i = 0; i < owned(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    const double mass = model_.mass[index];
    const auto x = position_.vector(i);
    Eigen::Matrix<double, 3, force_kinds> forces;
    forces.col(of_wall) = wall.col(i);
    forces.col(of_gas) = gas.col(i);
    forces.col(of_inertia).setZero();
    if (options_.inertia) {
      forces.col(of_inertia) = -mass / (h_ * h_) * (x - predicted_.col(i));
    }
    forces.col(of_drag) = damping.col(i) - options_.mass_damping * mass / h_ * (x - start_.vector(i));
    forces.col(of_weight) = mass * model_.gravity;
    forces.col(of_loads).setZero();
    if (!model_.loads.empty()) {
      forces.col(of_loads) = -model_.loads.at(i, x).gradient;
    }
    forces = (model_.constraints.projectors()[index] * forces).eval();
    for (int kind = 0; kind < force_kinds; ++kind) {
      squared_forces_[static_cast<std::size_t>(kind)] += forces.col(kind).squaredNorm();
    }
    Eigen::Map<Eigen::Vector3d>(values + 3 * i) = -forces.rowwise().sum();
  }
  if (rank_ == 0) {
    const Eigen::VectorXd rows = -pressure_scales().cwiseProduct(excess_volume());
    std::copy(rows.begin(), rows.end(), values + 3 * owned());
  }
  check(VecRestoreArray(residual, &values));
}

std::array<double, StepPotential::force_kinds> StepPotential::force_norms() const {
  std::array<double, force_kinds> norms = squared_forces_;
  MPI_Allreduce(MPI_IN_PLACE, norms.data(), force_kinds, MPI_DOUBLE, MPI_SUM, comm());
  for (double& norm : norms) {
    norm = std::sqrt(norm);
  }
  return norms;
}

void StepPotential::update_tangent(Tangent kind, LowRankSystem& system) {
  const bool positive = kind == Tangent::positive;
  evaluate_gas();
  const Membrane& membrane = model_.elements.membrane();
  std::vector<double> load_pressure;
  if (model_.gas_tangent == GasTangent::exact && model_.chambers.count() > 0) {
    load_pressure.resize(membrane.triangles.size());
    for (std::size_t e = 0; e < load_pressure.size(); ++e) {
      const int chamber = model_.chambers.of_element(static_cast<PetscInt>(e));
      load_pressure[e] = chamber >= 0 ? gas_[static_cast<std::size_t>(chamber)].pressure : 0;
    }
  }
  std::vector<Eigen::Matrix3d> blocks(static_cast<std::size_t>(owned()));
  for (PetscInt i = 0; i < owned(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    const double mass = model_.mass[index];
    blocks[index] =
        (options_.mass_damping * mass / h_ + (options_.inertia ? mass / (h_ * h_) : 0)) * Eigen::Matrix3d::Identity();
    if (!model_.loads.empty()) {
      blocks[index] += model_.loads.at(i, position_.vector(i)).hessian;
    }
  }
  tangent_.update({position_, thickness_ratio_, load_pressure, model_.constraints.origin(), blocks,
                   options_.stiffness_damping / h_, positive});

  Eigen::MatrixXd gradients(3 * owned(), model_.chambers.count());
  Eigen::VectorXd coefficients(model_.chambers.count());
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    Eigen::Matrix3Xd gradient = model_.chambers.volume_gradient(chamber, position_);
    for (PetscInt i = 0; i < owned(); ++i) {
      gradient.col(i) = model_.constraints.projectors()[static_cast<std::size_t>(i)] * gradient.col(i);
    }
    gradients.col(chamber) = gradient.reshaped();
    const GasState& gas = gas_[static_cast<std::size_t>(chamber)];
    const double stiffness = model_.chambers.prescribes_volume(chamber)
                                 ? bordering_stiffness(chamber)
                                 : -rank_one_share(model_.gas_tangent) * gas.pressure_slope;
    coefficients[chamber] = positive ? std::max(stiffness, 0.0) : stiffness;
  }
  system.update(gradients, coefficients);
}

double StepPotential::bordering_stiffness(int chamber) const {
  const double volume = std::abs(volumes_[chamber]);
  const double pressure = std::abs(gas_[static_cast<std::size_t>(chamber)].pressure);
  return 10 * (pressure + force_scale_ / std::pow(volume, 2.0 / 3)) / volume;
}

double StepPotential::value() {
  evaluate_gas();
  displacement_.values() = position_.values() - start_.values();
  double sum = model_.elements.energy(position_, thickness_ratio_);
  for (PetscInt i = 0; i < owned(); ++i) {
    const double mass = model_.mass[static_cast<std::size_t>(i)];
    const auto x = position_.vector(i);
    sum += options_.mass_damping * mass / (2 * h_) * (x - start_.vector(i)).squaredNorm();
    sum -= mass * model_.gravity.dot(x - start_.vector(i));
    if (options_.inertia) {
      sum += mass / (2 * h_ * h_) * (x - predicted_.col(i)).squaredNorm();
    }
    if (!model_.loads.empty()) {
      sum += model_.loads.at(i, x).value;
    }
  }
  if (options_.stiffness_damping > 0) {
    Eigen::Matrix3Xd product = Eigen::Matrix3Xd::Zero(3, owned());
    tangent_.add_lagged_product(options_.stiffness_damping / h_, displacement_, product);
    sum += product.cwiseProduct(displacement_.values().leftCols(owned())).sum() / 2;
  }
  sum = sum_over_ranks(comm(), sum);
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    if (!model_.chambers.prescribes_volume(chamber)) {
      sum += gas_[static_cast<std::size_t>(chamber)].potential;
    }
  }
  return sum;
}

}  // namespace pellicle
