#include "equilibrium/wall_part.h"

#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "energies/vertex_potential.h"
#include "parallel/collective.h"

namespace pellicle::equilibrium {

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

WallPart::WallPart(const WallModel& model, const PrismOptions& options, const TimeIntegrator& integrator)
    : PartOfPotentials(model.elements.membrane().particles, model.elements.membrane().triangles, options.snes_rtol),
      model_(model),
      options_(options_of_step(options, integrator)),
      integrator_(integrator),
      wall_(model.elements, options_),
      damping_(model.elements, model.mass, options_),
      start_(vertices_, 3),
      y_a_(3, vertices_.local()),
      y_v_(3, vertices_.local()) {
  const Membrane& membrane = model_.elements.membrane();
  potentials_ = {&wall_, &damping_};
  add_vertex_potentials();
  potentials_.insert(potentials_.end(), model_.others.begin(), model_.others.end());

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
}

void WallPart::add_vertex_potentials() {
  const auto add = [this](std::unique_ptr<Potential>& potential, auto&& function) {
    potential = make_vertex_potential(vertices_, function);
    potentials_.push_back(potential.get());
  };
  if (integrator_.is_static() || options_.inertia) {
    add(inertia_, [this](PetscInt i, const Eigen::Vector3d& x) {
      constexpr double fraction = 1e-6;  // of the stiffness of the wall, in statics
      const double mass = model_.mass[i];
      const double stiffness = integrator_.is_static() ? fraction * force_scale_ / length_scale_ * mass / total_mass_
                                                       : mass * integrator_.inertia(h_);
      const Eigen::Vector3d away = x - (integrator_.is_static() ? Eigen::Vector3d(start_.vector(i)) : y_a_.col(i));
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

double WallPart::work_of(const Potential& potential, const Field& end) const {
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, owned());
  potential.add_gradient(position_, gradient);
  return -gradient.cwiseProduct((end.values() - start_.values()).leftCols(owned())).sum();
}

StepWork WallPart::work(const Field& end, const Field& start_velocity, const Eigen::Matrix3Xd& of_gas) {
  const Eigen::Matrix3Xd moved = (end.values() - start_.values()).leftCols(owned());
  std::array<double, 5> sums{work_of(*weight_, end), work_of(damping_, end), 0,
                             of_gas.size() > 0 ? of_gas.cwiseProduct(moved).sum() : 0,
                             loads_ != nullptr ? work_of(*loads_, end) : 0};
  // The work on constrained vertices that no other force does is done by the pins.
  const std::vector<bool>& pinned = model_.pins.pinned();
  bool leads = false;
  for (PetscInt i = 0; i < owned(); ++i) {
    leads = leads || (pinned[i] && moved.col(i) != Eigen::Vector3d::Zero());
  }
  if (on_any_rank(comm(), leads)) {
    Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, owned());
    if (of_gas.size() > 0) {
      gradient -= of_gas;
    }
    for (const Potential* potential : potentials_) {
      if (potential != inertia_.get()) {
        potential->add_gradient(position_, gradient);
      }
    }
    for (PetscInt i = 0; i < owned(); ++i) {
      if (pinned[i]) {
        const double mass = options_.inertia ? model_.mass[i] : 0;
        const Eigen::Vector3d inertia = mass / h_ * (moved.col(i) / h_ - start_velocity.vector(i));
        sums[2] += (inertia + gradient.col(i)).dot(moved.col(i));
      }
    }
  }
  sums = sum_over_ranks(comm(), sums);
  return {sums[0], sums[1], sums[2], sums[3], sums[4]};
}

void WallPart::begin_step(const Field& position, const StepStart& start) {
  set_step(position, start, integrator_.fraction());
  const Projectors& projectors = model_.constraints.projectors;
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
    forget();
  };
  if (inverted(start_, position_) > 0) {
    start_from(0);
  }
  begin_here();
  if (!std::isfinite(value())) {
    start_from(0);
    begin_here();
  }
}

/// Moves the first iterate back so that nothing has passed through anything. Collective.
void WallPart::stop_at_contact() {
  const Eigen::Matrix3Xd before = position_.values();
  for (Potential* potential : potentials_) {
    potential->start_from(start_, position_, h_);
  }
  for (PetscInt i = 0; i < before.cols(); ++i) {  // As far as vertices may go there.
    const Eigen::Vector3d moved = position_.vector(i) - before.col(i);
    position_.vector(i) = before.col(i) + model_.constraints.projectors[i] * moved;
  }
}

bool WallPart::leaves_held_behind() {
  const Eigen::Matrix3Xd here = position_.values();
  move_held();
  const bool leaves = on_any_rank(comm(), here != position_.values());
  position_.values() = here;
  return leaves;
}

/// Sets the data of a step. @param fraction of the step at which forces are in balance
void WallPart::set_step(const Field& position, const StepStart& start, double fraction) {
  forget();
  h_ = start.h;
  time_end_ = start.time + integrator_.load_step(h_);
  start_.values() = position.values();
  const double own_place = position.values().cols() > 0 ? position.values().cwiseAbs().maxCoeff() : 0;
  const double place = max_over_ranks(comm(), own_place);
  const auto vertices = static_cast<double>(vertices_.global);
  const double inertia = options_.inertia ? total_mass_ / vertices * integrator_.inertia(h_) : 0;
  rounding_of_inertia_ = 20 * std::numeric_limits<double>::epsilon() * std::sqrt(vertices) * inertia * place;
  wall_.set_thickness(start.thickness_ratio);
  model_.loads.set_time(fraction == 1 ? time_end_ : start.time + fraction * start.h);
}

void WallPart::set_time(double time) {
  forget();
  time_end_ = time;
  model_.loads.set_time(time);
}

void WallPart::set_load(std::vector<double> pressure, const std::vector<PetscInt>& rims) {
  for (std::size_t e = 0; e < pressure.size(); ++e) {
    pressure[e] = model_.elements.stiffness(e) != 0 ? pressure[e] : 0;
  }
  wall_.set_load(std::move(pressure), rims);
}

/// Moves constrained vertices to their places at the balance, on a straight way to the end of the step.
void WallPart::move_held() {
  model_.pins.impose(position_, time_end_);
  for (PetscInt i = 0; integrator_.fraction() != 1 && i < position_.values().cols(); ++i) {
    if (model_.pins.pinned()[i]) {
      position_.vector(i) = start_.vector(i) + integrator_.fraction() * (position_.vector(i) - start_.vector(i));
    }
  }
}

Eigen::Matrix3Xd WallPart::forces_at(const Field& position, const StepStart& start) {
  set_step(position, start, 0);
  position_.values() = position.values();
  y_a_ = position_.values();
  y_v_ = position_.values() - start.velocity->values() / rate();
  damping_.begin_step(start_, start.thickness_ratio, y_v_, rate());
  return -gradient();
}

double WallPart::inverted(const Field& from, const Field& to) const {
  return sum_over_ranks(comm(), static_cast<double>(model_.elements.inverted(from, to)));
}

}  // namespace pellicle::equilibrium
