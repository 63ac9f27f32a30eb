#include "equilibrium/step_potential.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "energies/vertex_potential.h"
#include "parallel/collective.h"

namespace pellicle {
inline namespace equilibrium {

namespace {

/// Options of a step. A step in time that ends when it has converged uses the exact tangent near its end, since
/// Newton's method converges slowly without it, and changes a tangent that is not positive definite as little as
/// necessary. By arc length the path follows from the whole tangent.
PrismOptions options_of_step(PrismOptions options, const TimeIntegrator& integrator) {
  if (integrator.is_static()) {
    options.inertia = false;
    options.mass_damping = 0;
    options.stiffness_damping = 0;
  }
  const bool is_exact = integrator.arc_length() || (!integrator.is_static() && options.newton == NewtonEnd::converged);
  options.positive_elements = options.positive_elements && !is_exact;
  return options;
}

}  // namespace

StepPotential::StepPotential(const BalloonModel& model, const PrismOptions& options, const TimeIntegrator& integrator)
    : model_(model),
      options_(options_of_step(options, integrator)),
      integrator_(integrator),
      wall_(model.elements, options_),
      damping_(model.elements, model.mass, options_),
      start_(model.elements.membrane().particles, 3),
      position_(model.elements.membrane().particles, 3),
      y_a_(3, model.elements.membrane().particles.local()),
      y_v_(3, model.elements.membrane().particles.local()),
      direction_(model.elements.membrane().particles, 3) {
  const Membrane& membrane = model_.elements.membrane();
  potentials_ = {&wall_, &damping_};
  add_vertex_potentials();
  potentials_.insert(potentials_.end(), model_.others.begin(), model_.others.end());
  if (model_.bodies != nullptr) {
    potentials_.push_back(model_.bodies);
  }

  // Scale of the wall's forces: the energy of a wall stretched by half, over the square root of its area. Extrapolated
  // from a small stretch, since not every material can be stretched that far.
  constexpr double strain = 1e-3;
  std::array<double, 3> sums{};
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    sums[0] += model_.elements.wall().rest[e].area;
  }
  position_.values() = (1 + strain) * membrane.rest;
  sums[1] = wall_.value(position_);
  sums[2] = std::accumulate(model.mass.begin(), model.mass.end(), 0.0);
  sums = sum_over_ranks(comm(), sums);
  length_scale_ = std::sqrt(sums[0]);
  force_scale_ = sums[1] * std::pow(0.5 / strain, 2) / length_scale_;
  total_mass_ = sums[2];
  // Multigrid needs every entry, and a tangent that is positive definite by itself: without inertia the balloon's rigid
  // motions are nearly free.
  suits_patches_ = options_.mat_type != TangentMatrix::shell && options_.inertia;
  gas_ = std::make_shared<StepGas>(std::vector<StepGas::Part>{gas_part()});
}

void StepPotential::add_vertex_potentials() {
  const auto add = [this](std::unique_ptr<Potential>& potential, auto&& function) {
    potential = make_vertex_potential(model_.elements.membrane().particles, function);
    potentials_.push_back(potential.get());
  };
  if (integrator_.is_static()) {
    add(inertia_, [this](PetscInt i, const Eigen::Vector3d& x) {
      constexpr double fraction = 1e-6;  // of the stiffness of the wall
      const double stiffness = fraction * force_scale_ / length_scale_ * model_.mass[i] / total_mass_;
      const Eigen::Vector3d away = x - start_.vector(i);
      return PointPotential{stiffness / 2 * away.squaredNorm(), stiffness * away,
                            stiffness * Eigen::Matrix3d::Identity()};
    });
  } else if (options_.inertia) {
    add(inertia_, [this](PetscInt i, const Eigen::Vector3d& x) {
      const double stiffness = model_.mass[i] * integrator_.inertia(h_);
      const Eigen::Vector3d away = x - y_a_.col(i);
      return PointPotential{stiffness / 2 * away.squaredNorm(), stiffness * away,
                            stiffness * Eigen::Matrix3d::Identity()};
    });
  }
  add(weight_, [this](PetscInt i, const Eigen::Vector3d& x) {
    const Eigen::Vector3d weight = model_.mass[i] * model_.gravity;
    return PointPotential{-weight.dot(x - start_.vector(i)), -weight};
  });
  if (!model_.loads.empty()) {
    add(loads_, [this](PetscInt i, const Eigen::Vector3d& x) { return model_.loads.at(i, x); });
  }
}

double StepPotential::work_of(const Potential& potential, const Field& end) const {
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, owned());
  potential.add_gradient(position_, gradient);
  return -gradient.cwiseProduct((end.values() - start_.values()).leftCols(owned())).sum();
}

StepWork StepPotential::work(const Field& end, const Field& start_velocity) {
  const Eigen::Matrix3Xd moved = (end.values() - start_.values()).leftCols(owned());
  const Eigen::Matrix3Xd pressing = -gas_->gradient(part_);
  std::array<double, 6> sums{work_of(*weight_, end),
                             work_of(damping_, end),
                             0,
                             pressing.cwiseProduct(moved).sum(),
                             loads_ != nullptr ? work_of(*loads_, end) : 0,
                             model_.bodies != nullptr ? work_of(*model_.bodies, end) : 0};
  // The work on constrained vertices that no other force does is done by the pins.
  const std::vector<bool>& pinned = model_.pins.pinned();
  bool leads = false;
  for (PetscInt i = 0; i < owned(); ++i) {
    leads = leads || (pinned[i] && moved.col(i) != Eigen::Vector3d::Zero());
  }
  if (on_any_rank(comm(), leads)) {
    Eigen::Matrix3Xd gradient = -pressing;
    for (const Potential* potential : potentials_) {
      if (potential != inertia_.get()) {
        potential->add_gradient(position_, gradient);
      }
    }
    for (PetscInt i = 0; i < owned(); ++i) {
      if (pinned[i]) {
        const double mass = options_.inertia && !integrator_.is_static() ? model_.mass[i] : 0;
        const Eigen::Vector3d inertia = mass / h_ * (moved.col(i) / h_ - start_velocity.vector(i));
        sums[2] += (inertia + gradient.col(i)).dot(moved.col(i));
      }
    }
  }
  sums = sum_over_ranks(comm(), sums);
  return {sums[0], sums[1], sums[2], sums[3], sums[4], sums[5]};
}

void StepPotential::begin_step(const Field& position, const Eigen::VectorXd& pressure, const StepStart& start) {
  set_step(position, start, integrator_.fraction());
  const Projectors& projectors = model_.constraints.projectors();
  const auto start_from = [&](double fraction) {
    for (PetscInt i = 0; i < position_.values().cols(); ++i) {
      position_.vector(i) = start_.vector(i) + fraction * (projectors[i] * integrator_.predicted(h_, start.motion(i)));
    }
    move_held();
  };
  start_from(1);
  for (PetscInt i = 0; i < position_.values().cols(); ++i) {
    const Kinematics motion = start.motion(i);
    y_a_.col(i) = start_.vector(i) + projectors[i] * integrator_.y_a(h_, motion);
    y_v_.col(i) = start_.vector(i) + projectors[i] * integrator_.y_v(h_, motion);
    if (model_.pins.pinned()[i] && !integrator_.is_static()) {  // They move evenly, whatever their velocity was.
      y_a_.col(i) = position_.vector(i);
      y_v_.col(i) =
          position_.vector(i) - (position_.vector(i) - start_.vector(i)) / (rate() * integrator_.fraction() * h_);
    }
  }
  const auto begin_here = [&] {
    stop_at_contact();
    damping_.begin_step(integrator_.is_second_order() ? position_ : start_, start.thickness_ratio, y_v_, rate());
    sum_.forget();
  };
  if (integrator_.arc_length()) {
    begin_path(start);
    begin_here();
  } else {
    if (inverted(start_, position_) > 0) {
      start_from(0);
    }
    begin_here();
    evaluate();
    if (!std::isfinite(sum_over_ranks(comm(), sum_.value()))) {
      start_from(0);
      begin_here();
    }
  }
  gas_->begin_step(time_);
  gas_->set_multiplier(part_, pressure(gas_->prescribed(part_)));
  gas_->balance(part_, *this);
}

/// Moves the first iterate back so that nothing has passed through anything. Collective.
void StepPotential::stop_at_contact() {
  const Eigen::Matrix3Xd before = position_.values();
  for (Potential* potential : potentials_) {
    potential->start_from(start_, position_, h_);
  }
  for (PetscInt i = 0; i < before.cols(); ++i) {  // As far as vertices may go there.
    const Eigen::Vector3d moved = position_.vector(i) - before.col(i);
    position_.vector(i) = before.col(i) + model_.constraints.projectors()[i] * moved;
  }
}

bool StepPotential::leaves_held_behind() {
  const Eigen::Matrix3Xd here = position_.values();
  move_held();
  const bool leaves = on_any_rank(comm(), here != position_.values());
  position_.values() = here;
  return leaves;
}

/// Sets the data of a step. @param fraction of the step at which forces are in balance
void StepPotential::set_step(const Field& position, const StepStart& start, double fraction) {
  sum_.forget();
  h_ = start.h;
  time_end_ = start.time + start.h;
  time_ = fraction == 1 ? time_end_ : start.time + fraction * start.h;
  start_.values() = position.values();
  double place = position.values().cols() > 0 ? position.values().cwiseAbs().maxCoeff() : 0;
  place = max_over_ranks(comm(), place);
  const bool has_inertia = options_.inertia && !integrator_.is_static();
  const auto vertices = static_cast<double>(model_.elements.membrane().particles.global);
  const double inertia = has_inertia ? total_mass_ / vertices * integrator_.inertia(h_) : 0;
  rounding_of_inertia_ = 20 * std::numeric_limits<double>::epsilon() * std::sqrt(vertices) * inertia * place;
  wall_.set_thickness(start.thickness_ratio);
  model_.loads.set_time(time_);
  if (model_.bodies != nullptr) {
    model_.bodies->begin_step(start_, time_, fraction > 0 ? fraction * h_ : h_);
  }
}

/// Sets the loads to their present time by arc length.
void StepPotential::set_load_time() {
  sum_.forget();
  model_.loads.set_time(time_);
  gas_->set_time(time_);
  if (model_.bodies != nullptr) {
    model_.bodies->set_time(time_, h_);
  }
}

/// Moves constrained vertices to their places at the balance, on a straight way to the end of the step.
void StepPotential::move_held() {
  model_.pins.impose(position_, time_end_);
  for (PetscInt i = 0; integrator_.fraction() != 1 && i < position_.values().cols(); ++i) {
    if (model_.pins.pinned()[i]) {
      position_.vector(i) = start_.vector(i) + integrator_.fraction() * (position_.vector(i) - start_.vector(i));
    }
  }
}

/// Begins a step along the path; Newton's first iteration follows the tangent of the path. Collective.
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
  damping_.begin_step(start_, start.thickness_ratio, y_v_, rate());  // The first step: to where the loads push.
  const Eigen::VectorXd load = load_rate();
  for (PetscInt i = 0; i < owned(); ++i) {
    direction_.vector(i) = -load.segment<3>(3 * i) / model_.mass[i];
  }
  direction_.update_ghosts();
  set_unit_length(direction_);
}

/// Scales a direction to the root mean square 1, unless it is 0. Collective.
void StepPotential::set_unit_length(Field& direction) const {
  double square = 0;
  for (PetscInt i = 0; i < owned(); ++i) {
    square += model_.mass[i] / total_mass_ * direction.vector(i).squaredNorm();
  }
  square = sum_over_ranks(comm(), square);
  if (square > 0) {
    direction.values() /= std::sqrt(square);
  }
}

void StepPotential::write_direction(const Field& position, Field& direction) const {
  for (PetscInt i = 0; i < position.values().cols(); ++i) {
    direction.vector(i) = model_.constraints.projectors()[i] * Eigen::Vector3d(position.vector(i) - start_.vector(i));
  }
  set_unit_length(direction);
}

/// Distance of x along the path. Collective.
double StepPotential::along_path() const {
  double sum = 0;
  for (PetscInt i = 0; i < owned(); ++i) {
    sum += model_.mass[i] / total_mass_ * direction_.vector(i).dot(position_.vector(i) - start_.vector(i));
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
    move_held();
  };
  set_time(time + step);
  const Eigen::Matrix3Xd later = gradient();
  set_time(time);
  return ((later - here) / step).reshaped();
}

void StepPotential::write_end(Field& position) const {
  if (integrator_.fraction() == 1) {
    position.values() = position_.values();
    return;
  }
  position.values() = start_.values() + (position_.values() - start_.values()) / integrator_.fraction();
  model_.pins.impose(position, time_end_);
}

std::string StepPotential::end_step(Field& position, Eigen::VectorXd& pressure) const {
  write_end(position);
  pressure(prescribed()) = multiplier();
  const bool is_further_on = integrator_.fraction() != 1;
  return is_further_on && inverted(start_, position) > 0 ? "the end of the step turns elements over: it is too long"
                                                         : "";
}

Eigen::Matrix3Xd StepPotential::acceleration(const Field& position, const StepStart& start) {
  set_step(position, start, 0);
  position_.values() = position.values();
  y_a_ = position_.values();
  // At a moment no gas flows, and links of chambers have no effect.
  const auto shared = std::exchange(gas_, std::make_shared<StepGas>(std::vector<StepGas::Part>{gas_part()}));
  const std::size_t part = std::exchange(part_, 0);
  gas_->begin_step(time_);
  y_v_ = position_.values() - start.velocity.values() / rate();
  damping_.begin_step(start_, start.thickness_ratio, y_v_, rate());
  Eigen::Matrix3Xd result = -gradient();
  for (PetscInt i = 0; i < owned(); ++i) {
    result.col(i) /= model_.mass[i];
  }
  share_gas(shared, part);
  return result;
}

Eigen::VectorXd StepPotential::own_unknowns() const {
  if (integrator_.arc_length()) {
    return Eigen::VectorXd::Constant(1, time_);
  }
  return multiplier().cwiseQuotient(pressure_scales());
}

void StepPotential::move_to(const Field& position, const Eigen::VectorXd& own) {
  if (on_any_rank(comm(), position_.values() != position.values())) {
    position_.values() = position.values();
    sum_.forget();
    gas_->move();
  }
  if (integrator_.arc_length()) {
    time_ = own[0];
    time_end_ = time_;
    set_load_time();
    move_held();
  } else {
    gas_->set_multiplier(part_, own.cwiseProduct(pressure_scales()));
  }
}

double StepPotential::inverted(const Field& from, const Field& to) const {
  return sum_over_ranks(comm(), static_cast<double>(model_.elements.inverted(from, to)));
}

/// Gradient of Pi at x by the owned vertices, in the directions in which they may move. Collective.
const Eigen::Matrix3Xd& StepPotential::gradient() {
  evaluate();
  Eigen::Matrix3Xd of_gas = gas_->gradient(part_);
  model_.constraints.projectors().apply(of_gas);
  squared_forces_ = sum_.squares();
  squared_forces_.push_back(of_gas.squaredNorm());
  with_gas_ = sum_.gradient() + of_gas;
  return with_gas_;
}

Eigen::VectorXd StepPotential::own_rows() {
  if (integrator_.arc_length()) {
    return Eigen::VectorXd::Constant(1, path_scale() * (along_path() - path_length_));
  }
  return -pressure_scales().cwiseProduct(volume_residual());
}

void StepPotential::begin_tangent(Curvature curvature, double psd_blend) {
  for (Potential* potential : potentials_) {
    potential->set_psd_blend(psd_blend);
  }
  std::vector<double> load_pressure = gas_->load_pressure(part_);
  for (std::size_t e = 0; e < load_pressure.size(); ++e) {
    load_pressure[e] = model_.elements.stiffness(e) != 0 ? load_pressure[e] : 0;
  }
  wall_.set_load(std::move(load_pressure), model_.chambers.rims().sides());
  left_ = curvature == Curvature::psd ? 0 : 1 - psd_blend;
}

LowRank StepPotential::dense_tangent() {
  LowRank result = projected(gas_->begin_tangent(part_, left_), model_.constraints.projectors());
  if (integrator_.arc_length()) {  // Many times what the stiffness along the path can be, whatever its sign.
    double scale = force_scale_ / length_scale_;
    for (const GasState& gas : gas_->states(part_)) {
      scale += std::abs(gas.pressure) * std::cbrt(std::abs(gas.volume));
    }
    result.coefficients.conservativeResize(columns());
    result.coefficients[columns() - 1] = 10 * scale;
    result.mixing = Eigen::MatrixXd::Identity(columns(), columns());
    result.sparse.conservativeResize(3 * owned(), columns());
    for (PetscInt i = 0; i < owned(); ++i) {
      for (int k = 0; k < 3; ++k) {
        result.sparse.insert(3 * i + k, columns() - 1) = model_.mass[i] / total_mass_ * direction_.vector(i)[k];
      }
    }
    result.sparse.makeCompressed();
  }
  return result;
}

double StepPotential::value() {
  evaluate();
  return sum_over_ranks(comm(), sum_.value()) + gas_->value(part_);
}

}  // namespace equilibrium
}  // namespace pellicle
