#include "equilibrium/step_potential.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "geometry/principal_axes.h"
#include "parallel/collective.h"
#include "solvers/vertex_potential.h"

namespace pellicle {
inline namespace equilibrium {

namespace {

double sum_over_ranks(MPI_Comm comm, double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, comm);
  return value;
}

/// Share of dV/dx dV/dx^T dp/dV that a tangent takes: the paper's 1/27 is a third of the exact 1/9 (eq. 16).
double rank_one_share(GasTangent gas_tangent) { return gas_tangent == GasTangent::paper ? 1.0 / 3 : 1.0; }

}  // namespace

StepPotential::StepPotential(const BalloonModel& model, const PrismOptions& options, const TimeIntegrator& integrator)
    : model_(model),
      options_(options),
      integrator_(integrator),
      wall_(model.elements, options),
      damping_(model.elements, model.mass, options),
      start_(model.elements.membrane().particles, 3),
      position_(model.elements.membrane().particles, 3),
      between_(model.elements.membrane().particles, 3),
      unaccelerated_(3, model.elements.membrane().particles.local()),
      still_(3, model.elements.membrane().particles.local()),
      direction_(model.elements.membrane().particles, 3) {
  const Membrane& membrane = model_.elements.membrane();
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    if (model_.chambers.prescribes_volume(chamber)) {
      prescribed_.push_back(chamber);
    }
  }
  multiplier_.setZero(static_cast<Eigen::Index>(prescribed_.size()));
  gas_.resize(static_cast<std::size_t>(model_.chambers.count()));
  for (PetscInt i = 0; i < owned(); ++i) {
    if (!model_.constraints.projectors()[static_cast<std::size_t>(i)].isIdentity(0)) {
      constrained_.push_back(i);
    }
  }

  potentials_ = {&wall_, &damping_};
  add_vertex_potentials();
  potentials_.insert(potentials_.end(), model_.others.begin(), model_.others.end());
  if (model_.bodies != nullptr) {
    potentials_.push_back(model_.bodies);
  }

  // The energy of the wall half as long again, over the square root of its area: what its forces are like. Taken from a
  // small stretch, since not every material can go that far.
  constexpr double strain = 1e-3;
  double sums[3] = {0, 0, 0};
  for (std::size_t e = 0; e < static_cast<std::size_t>(membrane.elements.owned); ++e) {
    sums[0] += model_.elements.wall().rest[e].area;
  }
  position_.values() = (1 + strain) * membrane.rest;
  sums[1] = wall_.value(position_);
  sums[2] = std::accumulate(model.mass.begin(), model.mass.end(), 0.0);
  MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE, MPI_SUM, comm());
  length_scale_ = std::sqrt(sums[0]);
  force_scale_ = sums[1] * std::pow(0.5 / strain, 2) / length_scale_;
  total_mass_ = sums[2];
}

void StepPotential::add_vertex_potentials() {
  const auto add = [this](auto&& function) {
    of_vertices_.push_back(make_vertex_potential(model_.elements.membrane().particles, function));
    potentials_.push_back(of_vertices_.back().get());
  };
  if (integrator_.is_static()) {
    add([this](PetscInt i, const Eigen::Vector3d& x) {
      constexpr double share = 1e-6;  // of the stiffness of the wall
      const double stiffness =
          share * force_scale_ / length_scale_ * model_.mass[static_cast<std::size_t>(i)] / total_mass_;
      const Eigen::Vector3d away = x - start_.vector(i);
      return PointPotential{stiffness / 2 * away.squaredNorm(), stiffness * away,
                            stiffness * Eigen::Matrix3d::Identity()};
    });
  } else if (options_.inertia) {
    add([this](PetscInt i, const Eigen::Vector3d& x) {
      const double stiffness = model_.mass[static_cast<std::size_t>(i)] * integrator_.inertia(h_);
      const Eigen::Vector3d away = x - unaccelerated_.col(i);
      return PointPotential{stiffness / 2 * away.squaredNorm(), stiffness * away,
                            stiffness * Eigen::Matrix3d::Identity()};
    });
  }
  add([this](PetscInt i, const Eigen::Vector3d& x) {
    const Eigen::Vector3d weight = model_.mass[static_cast<std::size_t>(i)] * model_.gravity;
    return PointPotential{-weight.dot(x - start_.vector(i)), -weight};
  });
  if (!model_.loads.empty()) {
    add([this](PetscInt i, const Eigen::Vector3d& x) { return model_.loads.at(i, x); });
  }
}

void StepPotential::begin_step(const Field& position, const Eigen::VectorXd& pressure, const StepStart& start) {
  set_step(position, start, integrator_.share());
  const std::vector<Eigen::Matrix3d>& projectors = model_.constraints.projectors();
  const auto start_from = [&](double share) {
    for (PetscInt i = 0; i < position_.values().cols(); ++i) {
      position_.vector(i) = start_.vector(i) + share * (projectors[static_cast<std::size_t>(i)] *
                                                        integrator_.predicted(h_, start.motion(i)));
    }
    lead_held();
  };
  start_from(1);
  for (PetscInt i = 0; i < position_.values().cols(); ++i) {
    const auto vertex = static_cast<std::size_t>(i);
    const Motion motion = start.motion(i);
    unaccelerated_.col(i) = start_.vector(i) + projectors[vertex] * integrator_.unaccelerated(h_, motion);
    still_.col(i) = start_.vector(i) + projectors[vertex] * integrator_.still(h_, motion);
    if (model_.pins.pinned()[vertex] && !integrator_.is_static()) {  // They move evenly, whatever their velocity was.
      unaccelerated_.col(i) = position_.vector(i);
      still_.col(i) =
          position_.vector(i) - (position_.vector(i) - start_.vector(i)) / (rate() * integrator_.share() * h_);
    }
  }
  if (integrator_.arc_length()) {
    begin_path(start);
  } else if (inverted(start_, position_) > 0 || !std::isfinite(sum_over_ranks(comm(), wall_.value(position_)))) {
    start_from(0);
  }
  keep_clear();
  damping_.begin_step(integrator_.is_second_order() ? position_ : start_, start.thickness_ratio, still_, rate());
  multiplier_ = pressure(prescribed_);
  is_evaluated_ = false;
}

/// Where Newton's method begins nothing has passed through anything. Collective.
void StepPotential::keep_clear() {
  const Eigen::Matrix3Xd before = position_.values();
  for (Potential* potential : potentials_) {
    potential->start_from(start_, position_, h_);
  }
  for (PetscInt i = 0; i < before.cols(); ++i) {  // As far as vertices may go there.
    const Eigen::Vector3d moved = position_.vector(i) - before.col(i);
    position_.vector(i) = before.col(i) + model_.constraints.projectors()[static_cast<std::size_t>(i)] * moved;
  }
}

bool StepPotential::leaves_held_behind() {
  const Eigen::Matrix3Xd here = position_.values();
  lead_held();
  const bool leaves = on_any_rank(comm(), here != position_.values());
  position_.values() = here;
  return leaves;
}

/// What a step is about. @param share of it at which forces are in balance
void StepPotential::set_step(const Field& position, const StepStart& start, double share) {
  is_evaluated_ = false;
  h_ = start.h;
  time_end_ = start.time + start.h;
  time_ = share == 1 ? time_end_ : start.time + share * start.h;
  start_.values() = position.values();
  wall_.set_thickness(start.thickness_ratio);
  model_.loads.set_time(time_);
  if (model_.bodies != nullptr) {
    model_.bodies->begin_step(start_, time_, share > 0 ? share * h_ : h_);
  }
}

/// What acts by arc length, at the loads' present time.
void StepPotential::set_load_time() {
  is_evaluated_ = false;
  model_.loads.set_time(time_);
  if (model_.bodies != nullptr) {
    model_.bodies->set_time(time_, h_);
  }
}

/// Puts held vertices to where they are when forces are in balance: on their way straight to the end of the step.
void StepPotential::lead_held() {
  model_.pins.impose(position_, time_end_);
  for (PetscInt i = 0; integrator_.share() != 1 && i < position_.values().cols(); ++i) {
    if (model_.pins.pinned()[static_cast<std::size_t>(i)]) {
      position_.vector(i) = start_.vector(i) + integrator_.share() * (position_.vector(i) - start_.vector(i));
    }
  }
}

/// The step begins where the last one ended; Newton's first iteration goes along the tangent of the path. Collective.
void StepPotential::begin_path(const StepStart& start) {
  path_length_ = *integrator_.arc_length() * h_;
  time_end_ = start.time;
  time_ = start.time;
  position_.values() = start_.values();
  set_load_time();
  if (model_.bodies != nullptr) {
    model_.bodies->begin_step(start_, time_, h_);
  }
  direction_.values() = start.direction->values();
  if (sum_over_ranks(comm(), direction_.values().squaredNorm()) > 0) {
    return;
  }
  damping_.begin_step(start_, start.thickness_ratio, still_, rate());  // The first step: to where the loads push.
  const Eigen::VectorXd load = load_rate();
  for (PetscInt i = 0; i < owned(); ++i) {
    direction_.vector(i) = -load.segment<3>(3 * i) / model_.mass[static_cast<std::size_t>(i)];
  }
  direction_.update_ghosts();
  set_unit_length(direction_);
}

/// Where it is not 0 everywhere. Collective.
void StepPotential::set_unit_length(Field& direction) const {
  double square = 0;
  for (PetscInt i = 0; i < owned(); ++i) {
    square += model_.mass[static_cast<std::size_t>(i)] / total_mass_ * direction.vector(i).squaredNorm();
  }
  square = sum_over_ranks(comm(), square);
  if (square > 0) {
    direction.values() /= std::sqrt(square);
  }
}

void StepPotential::write_direction(const Field& position, Field& direction) const {
  for (PetscInt i = 0; i < position.values().cols(); ++i) {
    direction.vector(i) = model_.constraints.projectors()[static_cast<std::size_t>(i)] *
                          Eigen::Vector3d(position.vector(i) - start_.vector(i));
  }
  set_unit_length(direction);
}

/// How far x is along the path. Collective.
double StepPotential::along_path() const {
  double sum = 0;
  for (PetscInt i = 0; i < owned(); ++i) {
    sum += model_.mass[static_cast<std::size_t>(i)] / total_mass_ *
           direction_.vector(i).dot(position_.vector(i) - start_.vector(i));
  }
  return sum_over_ranks(comm(), sum);
}

Eigen::VectorXd StepPotential::load_rate() {
  const double time = time_;
  const Eigen::Matrix3Xd here = gradient();
  const double step = 1e-5 * h_;
  const auto set_time = [this](double at) {
    time_ = at;
    time_end_ = at;
    set_load_time();
    lead_held();
  };
  set_time(time + step);
  const Eigen::Matrix3Xd later = gradient();
  set_time(time);
  return ((later - here) / step).reshaped();
}

void StepPotential::write_end(Field& position) const {
  if (integrator_.share() == 1) {
    position.values() = position_.values();
    return;
  }
  position.values() = start_.values() + (position_.values() - start_.values()) / integrator_.share();
  model_.pins.impose(position, time_end_);
}

Eigen::Matrix3Xd StepPotential::acceleration(const Field& position, const StepStart& start) {
  set_step(position, start, 0);
  position_.values() = position.values();
  unaccelerated_ = position_.values();
  still_ = position_.values() - start.velocity.values() / rate();
  damping_.begin_step(start_, start.thickness_ratio, still_, rate());
  Eigen::Matrix3Xd result = -gradient();
  for (PetscInt i = 0; i < owned(); ++i) {
    result.col(i) /= model_.mass[static_cast<std::size_t>(i)];
  }
  return result;
}

Eigen::VectorXd StepPotential::own_unknowns() const {
  if (integrator_.arc_length()) {
    return Eigen::VectorXd::Constant(1, time_);
  }
  return multiplier_.cwiseQuotient(pressure_scales());
}

void StepPotential::move_to(const Field& position, const Eigen::VectorXd& own) {
  const Eigen::VectorXd multiplier = integrator_.arc_length() ? multiplier_ : own.cwiseProduct(pressure_scales());
  const bool stays = position_.values() == position.values() && multiplier_ == multiplier;
  is_evaluated_ = is_evaluated_ && !on_any_rank(comm(), !stays);
  position_.values() = position.values();
  multiplier_ = multiplier;
  if (integrator_.arc_length()) {
    time_ = own[0];
    time_end_ = time_;
    set_load_time();
    lead_held();
  }
}

Eigen::VectorXd StepPotential::pressure_scales() const {
  Eigen::VectorXd scales(prescribed_.size());
  std::transform(prescribed_.begin(), prescribed_.end(), scales.begin(),
                 [this](int chamber) { return force_scale_ / model_.chambers.initial_volume(chamber); });
  return scales;
}

Eigen::VectorXd StepPotential::excess_volume() const {
  Eigen::VectorXd excess(prescribed_.size());
  std::transform(prescribed_.begin(), prescribed_.end(), excess.begin(),
                 [this](int chamber) { return volumes_[chamber] - model_.chambers.prescribed_volume(chamber, time_); });
  return excess;
}

double StepPotential::inverted(const Field& from, const Field& to) const {
  return sum_over_ranks(comm(), static_cast<double>(model_.elements.inverted(from, to)));
}

/// Gas, value and gradient of Pi at x, unless they are known. Collective.
void StepPotential::evaluate() {
  if (std::exchange(is_evaluated_, true)) {
    return;
  }
  volumes_ = model_.chambers.volumes(position_);
  gas_ = model_.chambers.end_states(volumes_, time_);
  for (std::size_t c = 0; c < prescribed_.size(); ++c) {
    gas_[static_cast<std::size_t>(prescribed_[c])].pressure = multiplier_[static_cast<Eigen::Index>(c)];
  }
  potentials_value_ = 0;
  squared_forces_.clear();
  gradient_.setZero(3, owned());
  const auto add_part = [this] {
    for (const PetscInt i : constrained_) {
      part_.col(i) = (model_.constraints.projectors()[static_cast<std::size_t>(i)] * part_.col(i)).eval();
    }
    squared_forces_.push_back(part_.squaredNorm());
    gradient_ += part_;
  };
  for (const Potential* potential : potentials_) {
    part_.setZero(3, owned());
    potentials_value_ += potential->add_value_and_gradient(position_, part_);
    add_part();
  }
  const Eigen::SparseMatrix<double> gradients = model_.chambers.volume_gradients(position_);
  Eigen::VectorXd pressure(model_.chambers.count());
  double absolute = 0;  // squares of the forces of the absolute pressures
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    const GasState& state = gas_[static_cast<std::size_t>(chamber)];
    pressure[chamber] = state.pressure;
    absolute += std::pow(state.absolute_pressure, 2) * gradients.col(chamber).squaredNorm();
  }
  part_ = (gradients * -pressure).reshaped(3, owned());
  add_part();
  constexpr double share = 2e-14;  // to which amounts of gas are found, and pressures are differences of absolute ones
  gas_rounding_ = share * std::sqrt(sum_over_ranks(comm(), absolute));
}

Eigen::Matrix3Xd StepPotential::gradient() {
  evaluate();
  return gradient_;
}

Eigen::VectorXd StepPotential::own_rows() {
  if (integrator_.arc_length()) {
    return Eigen::VectorXd::Constant(1, path_scale() * (along_path() - path_length_));
  }
  return -pressure_scales().cwiseProduct(excess_volume());
}

LowRank StepPotential::begin_tangent(Curvature curvature, double positive_share) {
  evaluate();
  volumes_of_tangent_ = volumes_;
  position_of_tangent_ = position_.values();
  for (Potential* potential : potentials_) {
    potential->set_positive_share(positive_share);
  }
  const Membrane& membrane = model_.elements.membrane();
  std::vector<double> load_pressure;
  if (model_.gas_tangent == GasTangent::exact && model_.chambers.count() > 0) {
    load_pressure.resize(membrane.triangles.size());
    for (std::size_t e = 0; e < load_pressure.size(); ++e) {
      const int chamber = model_.chambers.of_triangle(static_cast<PetscInt>(e));
      const bool is_loaded = chamber >= 0 && model_.elements.stiffness(e) != 0;
      load_pressure[e] = is_loaded ? gas_[static_cast<std::size_t>(chamber)].pressure : 0;
    }
  }
  wall_.set_load(std::move(load_pressure), model_.chambers.rims().sides());
  const double left = curvature == Curvature::positive ? 0 : 1 - positive_share;
  LowRank result(model_.chambers.volume_gradients(position_), Eigen::VectorXd(columns()));
  // Its entries are blocks of three, of the vertices.
  Eigen::Map<Eigen::Matrix3Xd> blocks(result.sparse.valuePtr(), 3, result.sparse.nonZeros() / 3);
  for (Eigen::Index block = 0; block < blocks.cols(); ++block) {
    const auto vertex = static_cast<std::size_t>(result.sparse.innerIndexPtr()[3 * block] / 3);
    blocks.col(block) = (model_.constraints.projectors()[vertex] * blocks.col(block)).eval();
  }
  Eigen::VectorXd& coefficients = result.coefficients;
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    const GasState& gas = gas_[static_cast<std::size_t>(chamber)];
    const double stiffness = model_.chambers.prescribes_volume(chamber)
                                 ? bordering_stiffness(chamber)
                                 : -rank_one_share(model_.gas_tangent) * gas.pressure_slope;
    coefficients[chamber] = std::max(stiffness, left * stiffness);
  }
  mix_joined_columns(left, result);
  if (integrator_.arc_length()) {  // Many times what the stiffness along the path can be, whatever its sign.
    double scale = force_scale_ / length_scale_;
    for (const GasState& gas : gas_) {
      scale += std::abs(gas.pressure) * std::cbrt(std::abs(gas.volume));
    }
    coefficients[coefficients.size() - 1] = 10 * scale;
    result.mixing = Eigen::MatrixXd::Identity(columns(), columns());
    result.sparse.conservativeResize(3 * owned(), columns());
    for (PetscInt i = 0; i < owned(); ++i) {
      for (int k = 0; k < 3; ++k) {
        result.sparse.insert(3 * i + k, columns() - 1) =
            model_.mass[static_cast<std::size_t>(i)] / total_mass_ * direction_.vector(i)[k];
      }
    }
    result.sparse.makeCompressed();
  }
  return result;
}

/// The volumes of joined chambers change each other's pressures: their columns become those along which the symmetric
/// part of this stiffness is diagonal. (It is symmetric where all their pressures are the same.)
void StepPotential::mix_joined_columns(double left, LowRank& low_rank) const {
  if (!model_.chambers.has_network()) {
    return;
  }
  const std::vector<int>& joined = model_.chambers.joined();
  const Eigen::MatrixXd slopes = model_.chambers.joined_slopes(volumes_, time_);
  const PrincipalAxes principal = principal_axes(-(slopes + slopes.transpose()) / 2);
  low_rank.mixing(joined, joined) = principal.axes;
  for (std::size_t k = 0; k < joined.size(); ++k) {
    const double stiffness = rank_one_share(model_.gas_tangent) * principal.values[static_cast<Eigen::Index>(k)];
    low_rank.coefficients[joined[k]] = std::max(stiffness, left * stiffness);
  }
}

double StepPotential::bordering_stiffness(int chamber) const {
  const double volume = std::abs(volumes_[chamber]);
  const double pressure = std::abs(gas_[static_cast<std::size_t>(chamber)].pressure);
  return 10 * (pressure + force_scale_ / std::pow(volume, 2.0 / 3)) / volume;
}

/// Work of a given pressure on what is left of a wall with a hole, straight from x^n to x: by Simpson's rule, which is
/// exact, since the force is a square of the positions. This rank's share.
double StepPotential::work_on_rest(int chamber) {
  const auto force = [&](double share) {
    between_.values() = start_.values() + share * (position_.values() - start_.values());
    return model_.chambers.volume_gradient(chamber, between_);
  };
  const Eigen::Matrix3Xd mean = (force(0) + 4 * force(0.5) + force(1)) / 6;
  return gas_[static_cast<std::size_t>(chamber)].pressure *
         mean.cwiseProduct((position_.values() - start_.values()).leftCols(owned())).sum();
}

/// Work of joined chambers on walls with holes, straight from where the tangent was last taken to x. Collective.
double StepPotential::joined_work_on_rest() {
  // Gauss's rule with three points: places in (0, 1) and weights.
  const std::array<double, 3> places{0.1127016653792583, 0.5, 0.8872983346207417};
  const std::array<double, 3> weights{5.0 / 18, 8.0 / 18, 5.0 / 18};
  const Eigen::Matrix3Xd moved = position_.values() - position_of_tangent_;
  double work = 0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    between_.values() = position_of_tangent_ + places[k] * moved;
    const std::vector<GasState> states = model_.chambers.end_states(model_.chambers.volumes(between_), time_);
    const Eigen::VectorXd rates =
        model_.chambers.volume_gradients(between_).transpose() * moved.leftCols(owned()).reshaped();
    for (const int chamber : model_.chambers.joined()) {
      work += weights[k] * states[static_cast<std::size_t>(chamber)].pressure * rates[chamber];
    }
  }
  return sum_over_ranks(comm(), work);
}

double StepPotential::value() {
  evaluate();
  double sum = potentials_value_;
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    if (model_.chambers.has_hole(chamber)) {
      sum -= work_on_rest(chamber);
    }
  }
  sum = sum_over_ranks(comm(), sum);
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    if (!model_.chambers.prescribes_volume(chamber) && !model_.chambers.has_hole(chamber) &&
        !model_.chambers.is_joined(chamber)) {
      sum += gas_[static_cast<std::size_t>(chamber)].potential;
    }
  }
  if (model_.chambers.has_network() && volumes_of_tangent_.size() > 0) {
    sum -= model_.chambers.rims().empty() ? model_.chambers.joined_work(volumes_of_tangent_, volumes_, time_)
                                          : joined_work_on_rest();
  }
  return sum;
}

}  // namespace equilibrium
}  // namespace pellicle
