#include "world/sheet_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "ablation/ablation.h"
#include "ablation/drawn_shares.h"
#include "elastic/sheet_springs.h"
#include "equilibrium/time_scheme.h"
#include "io/console.h"
#include "parallel/collective.h"

namespace pellicle::world {

namespace {

/// phi = (1 - e^{-x})/x, 1 at 0: mean of e^{-t} between 0 and x.
double exact_share(double x) { return x > 0 ? -std::expm1(-x) / x : 1; }

/// Square root of the undeformed area [m]. Collective.
double size_of(const Sheet& sheet) {
  const std::vector<double> areas = cell_areas(sheet);
  double area = 0;
  for (std::size_t cell = 0; cell < areas.size(); ++cell) {
    area += sheet.lattice[cell] < sheet.particles.owned ? areas[cell] : 0;
  }
  return std::sqrt(sum_over_ranks(sheet.comm(), area));
}

/// (d - l)/l of the owned and ghost springs of a colour, d the present and l the target length; 0 of dead ones.
std::vector<double> strains(const SpringSet& springs, const State& state, Colour colour) {
  std::vector<double> result(springs.ends.size());
  for (std::size_t s = 0; s < springs.ends.size(); ++s) {
    const auto& [a, b] = springs.ends[s];
    if (state.burning->active.springs[colour][s]) {
      result[s] = (state.position.vector(a) - state.position.vector(b)).norm() / state.target_length[colour][s] - 1;
    }
  }
  return result;
}

/// Root mean square strain over the active springs of each local particle. Collective.
std::vector<double> strains_of_particles(const Sheet& sheet, const State& state) {
  Field sum(sheet.particles, 2);  // of squared strains, and how many
  for (const Colour colour : all_colours) {
    if (!sheet.acts(colour)) {
      continue;
    }
    const std::vector<double> strain = strains(sheet.of(colour), state, colour);
    for (PetscInt s = 0; s < sheet.of(colour).owned(); ++s) {
      for (const PetscInt end : sheet.of(colour).ends[s]) {
        if (state.burning->active.springs[colour][s]) {
          sum.values().col(end) += Eigen::Vector2d(strain[s] * strain[s], 1);
        }
      }
    }
  }
  sum.add_ghosts();
  sum.update_ghosts();
  std::vector<double> result;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    result.push_back(std::sqrt(sum.values()(0, i) / std::max(1.0, sum.values()(1, i))));
  }
  return result;
}

/// Draws the springs with their fields.
void draw_springs(Picture& picture, const Sheet& sheet, const State& state, double loss_mass) {
  const std::vector<double> level = level_set(sheet, state.burning->mass, loss_mass);
  std::vector<double> strain;
  std::vector<double> target_length;
  std::vector<double> spring_states;
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet.of(colour);
    const std::vector<double>& lengths = state.target_length[colour];
    const std::vector<double> of_colour = strains(set, state, colour);
    strain.insert(strain.end(), of_colour.begin(), of_colour.begin() + set.owned());
    target_length.insert(target_length.end(), lengths.begin(), lengths.begin() + set.owned());
    for (PetscInt s = 0; s < set.owned(); ++s) {
      const auto [a, b] = set.ends[s];
      spring_states.push_back(static_cast<double>(spring_state(level[a], level[b])));
    }
  }
  std::vector<double> mass_ratio;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    mass_ratio.push_back(state.burning->mass.data()[i] / sheet.initial_mass[i]);
  }
  picture.draw_springs(drawing_of_springs(sheet, state.burning->active));
  const auto numbers = [](const Field& field) {
    return std::vector<double>(field.data(), field.data() + field.values().size());
  };
  picture.add_on_spring_ends("temperature", numbers(state.burning->temperature));
  picture.add_on_spring_ends("mass_ratio", std::move(mass_ratio));
  picture.add_on_spring_ends("velocity", numbers(state.velocity), 3);
  picture.add_on_spring_ends("strain", strains_of_particles(sheet, state));
  picture.add_on_springs("strain", std::move(strain));
  picture.add_on_springs("target_length", std::move(target_length));
  picture.add_on_springs("state", std::move(spring_states));
}

}  // namespace

SheetMotion::SheetMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas,
                         double contact_stiffness, const TimeIntegrator& integrator)
    : SurfaceMotion(sheet, options, state, clock, gas, integrator),
      sheet_(sheet),
      pins_move_(
          std::any_of(options.pins.begin(), options.pins.end(), [](const auto& pin) { return pin.second.moves(); })),
      usual_stiffness_(contact_stiffness),
      constrained_(pins_.pinned()),
      size_(options.time.tolerance > 0 ? size_of(sheet) : 0) {
  mass_ = sheet.initial_mass;
  set_contact(contact_stiffness);
  if (cracks_of(options).strength) {
    spring_stress_.emplace(sheet);
  }
}

void SheetMotion::set_lengths() {
  set_volume_ratios(volume_ratio_, sheet_, state_.burning->mass, options_.combustion);
  set_target_lengths(state_.target_length, sheet_, volume_ratio_);
}

StageResult SheetMotion::begin(Step& step) {
  h_ = step.h;
  const Field& mass = state_.burning->mass;
  start_.values() = state_.position.values();
  start_velocity_.values() = state_.velocity.values();
  constrained_ = pins_.pinned();
  if (sheet_.layers == 1) {
    mass_ = corner_masses(sheet_, mass);
  } else {
    mass_.assign(mass.data(), mass.data() + sheet_.particles.local());
  }
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    constrained_[i] = constrained_[i] || mass_[i] == 0;
  }
  move_freely();
  carry_removed_corners(sheet_, state_.burning->active.triangles, mass, pins_.pinned(), state_.position, carried_);
  unconstrained_ = state_.position.values();
  return begin_balance(step);
}

void SheetMotion::move_freely() {
  Field::Values x = state_.position.values();
  Field::Values v = state_.velocity.values();
  const auto timer = clock_.time("external force");
  set_drag(1);
  // The exact step of m dv/dt = F - c m v by a constant force F: v e^{-ch} + h F phi/m, phi = (1 - e^{-ch})/(c h).
  // With the mass m/phi in place of m every force of the step does so; a sheet at rest bears all of its weight.
  // A step of statics ends at rest, and its weight is in the balance.
  fading_ = is_static() ? 0 : velocity_damping(options_) * h_;
  const double phi = exact_share(fading_);
  std::for_each(mass_.begin(), mass_.end(), [phi](double& inertia) { inertia /= phi; });
  if (is_static()) {
    v.setZero();
  } else {
    v *= std::exp(-fading_);
    v.colwise() += phi * h_ * options_.force.gravity;
  }
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    if (mass_[i] == 0) {
      v.col(i).setZero();
    }
  }
  if (air_ && options_.dynamics == Dynamics::projection) {  // Otherwise the balance has it.
    air_->accelerate(state_.velocity, mass_, h_);
  }
  x += h_ * v;
  pins_.impose(state_.position, end_of_loads());
  if (sheet_.layers == 1 && gas_ != nullptr) {
    follow_corners(sheet_, state_.position);
  }
  push_by_weights_of_gas();
}

/// Pushes the sheet by the weights of gas and air and by jets (Chambers::uneven_forces). Collective.
void SheetMotion::push_by_weights_of_gas() {
  if (gas_ == nullptr || gas_->uneven_forces() == nullptr) {
    return;
  }
  Field force(sheet_.particles, 3);
  force.values() = gas_->uneven_forces()->values();
  if (sheet_.layers == 1) {
    for (std::size_t cell = 0; cell < sheet_.cells.size(); ++cell) {
      for (const PetscInt corner : sheet_.cells[cell]) {
        force.vector(corner) += force.vector(sheet_.lattice[cell]) / 4;
      }
    }
    force.update_ghosts();
  }
  uneven_ = force.values().leftCols(sheet_.particles.owned);
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    if (!constrained_[i]) {
      const Eigen::Vector3d push = h_ / mass_[i] * force.vector(i);
      state_.velocity.vector(i) += push;
      state_.position.vector(i) += h_ * push;
    }
  }
  if (sheet_.layers == 1) {
    follow_corners(sheet_, state_.position);
  }
}

/// Takes the positions of a sheet with a part in the balance. Collective.
StageResult SheetMotion::take_positions(const StepPart& part, Step& step) {
  StageResult result;
  step.motion_iterations += step.balance.linear_iterations;
  step.newton_iterations = step.balance.newton_iterations;
  step.force_residual = step.balance.over_tolerance * part.tolerance();
  state_.position.values() = part.position().values();
  if (body_contact_ != nullptr) {
    step.contacts = body_contact_->contacts(state_.position);
    step.loads = body_contact_->loads(state_.position);
    result.reason = body_contact_->sweep().fault(step.loads);
  }
  keep_what_has_left();
  if (const std::optional<double> limit = options_.project.strain_limit; limit && result.reason.empty()) {
    const WeaveStrain strain = weave_strain();
    result.reason = strain.largest <= *limit ? "" : beyond_limit(strain, *limit) + ": where all forces are in balance";
  }
  result.converged = result.reason.empty();
  step.constraint_error =
      constraint_errors(sheet_, state_.position, state_.target_length, state_.burning->active).total;
  return result;
}

StageResult SheetMotion::take_balance(Step& step) {
  const StageResult result = find_positions(step);
  if (result.converged) {
    add_work();
    move_to_end();
  }
  return result;
}

const Eigen::Matrix3Xd& SheetMotion::forces_of(const Potential& potential) {
  work_.forces.setZero(3, sheet_.particles.owned);
  potential.add_gradient(state_.position, work_.forces);
  work_.forces *= -1;
  return work_.forces;
}

/// Adds the works of the step, by the forces with which it has ended. Must be called before the gas stage has ended.
/// Collective.
void SheetMotion::add_work() {
  const PetscInt owned = sheet_.particles.owned;
  const double phi = exact_share(fading_);
  Eigen::Matrix3Xd& all = work_.all;
  Eigen::VectorXd& works = work_.works;
  all.setZero(3, pins_move_ ? owned : 0);
  works.setZero(kinds_of_work);
  const auto moved = [&](PetscInt i) -> Eigen::Vector3d {
    return (state_.position.vector(i) - start_.vector(i)) / integrator_.fraction();
  };
  const auto add = [&](Work kind, const auto& force) {
    for (PetscInt i = 0; i < owned; ++i) {
      const Eigen::Vector3d added = force(i);
      of(works, kind) += added.dot(moved(i));
      if (pins_move_) {
        all.col(i) += added;
      }
    }
  };
  const auto add_all = [&](Work kind, const Eigen::Matrix3Xd& forces) {
    add(kind, [&forces](PetscInt i) -> Eigen::Vector3d { return forces.col(i); });
  };
  const auto mass = [&](PetscInt i) { return phi * mass_[i]; };
  add(Work::gravity, [&](PetscInt i) -> Eigen::Vector3d { return mass(i) * options_.force.gravity; });
  if (fading_ > 0) {  // See move_freely.
    add(Work::damping, [&](PetscInt i) -> Eigen::Vector3d {
      const Eigen::Vector3d after = moved(i) / h_;
      const Eigen::Vector3d before = start_velocity_.vector(i);
      const double m = constrained_[i] ? 0 : mass(i) / h_;
      return m * (after - before - (after - std::exp(-fading_) * before) / phi);
    });
  }
  if (damping_ > 0) {
    add(Work::damping, [&](PetscInt i) -> Eigen::Vector3d {
      return (constrained_[i] ? 0 : -damping_ * mass_[i]) * velocity_of_balance(i);
    });
  }
  if (air_) {
    add(Work::air, [&](PetscInt i) -> Eigen::Vector3d {
      const Eigen::Vector3d velocity = velocity_of_balance(i);
      return mass(i) > 0 ? Eigen::Vector3d(air_->push(i) - air_->resistance(i) * velocity) : Eigen::Vector3d::Zero();
    });
  }
  if (gas_ != nullptr) {
    add_all(Work::pressure, gas_forces());
  }
  if (uneven_.cols() > 0) {
    add_all(Work::pressure, uneven_);
  }
  if (body_contact_ != nullptr) {
    add_all(Work::bodies, forces_of(*body_contact_));
  }
  // Pins that move work on the particles that they hold by the force that balances all others and the inertia.
  if (pins_move_) {
    add_spring_forces(all);
    for (PetscInt i = 0; i < owned; ++i) {
      if (pins_.pinned()[i]) {
        const double inertial = is_static() ? 0 : mass(i);
        const Eigen::Vector3d inertia = inertial / h_ * (moved(i) / h_ - start_velocity_.vector(i));
        of(works, Work::pins) += (inertia - all.col(i)).dot(moved(i));
      }
    }
  }
  sum_over_ranks(sheet_.comm(), works);
  of(works, Work::damping) += viscous_work();
  state_.work += works;
}

void SheetMotion::find_velocities(Step& step) {
  const auto timer = clock_.time("velocity");
  const Field::Values x = state_.position.values();
  Field::Values v = state_.velocity.values();
  if (is_static()) {
    v.setZero();
    leave_bodies(step);
    return;
  }
  v += (x - unconstrained_) / h_;
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    if (constrained_[i]) {
      v.col(i) = (x.col(i) - start_.values().col(i)) / h_;
    }
  }
  if (options_.time.tolerance > 0) {  // By the largest error of implicit Euler of the particles that nothing holds.
    double error = 0;
    for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
      if (!constrained_[i]) {
        error = std::max(error, integrator_.error(h_, start_of(i), {state_.velocity.vector(i)}));
      }
    }
    step.error = max_over_ranks(sheet_.comm(), error) / size_;
  }
  leave_bodies(step);
  if (sheet_.layers == 1) {
    follow_corners(sheet_, state_.position);
    follow_corners(sheet_, state_.velocity);
  }
}

void SheetMotion::leave_bodies(Step& step) {
  if (body_contact_ != nullptr && !is_static()) {
    rebound(step.loads);
  }
}

std::string SheetMotion::progress(const Step& step) const { return fmt::format("|C| {:.3e} m", step.constraint_error); }

void SheetMotion::report(Report& report, const Step& step) const {
  report.add("constraint_error", "m", step.constraint_error);
  report.add("contacts", "", static_cast<double>(sum_over_ranks(sheet_.comm(), step.contacts)));
  report.add("projection_iterations", "", step.motion_iterations);
  report.add("newton_iterations", "", step.newton_iterations);
  report.add("force_residual", "", step.force_residual);
}

void SheetMotion::draw(Picture& picture) const {
  picture.add_on_particles("strain", strains_of_particles(sheet_, state_));
  const DrawnShares shares(sheet_, state_.burning->active, *picture.drawn(), state_.position);
  Field heat(sheet_.particles, 1);
  heat.values() =
      options_.heat.capacity * state_.burning->mass.values().cwiseProduct(state_.burning->temperature.values());
  picture.add_on_cells("areal_density", shares.density(state_.burning->mass));
  picture.add_on_cells("heat_density", shares.density(heat));
  if (options_.output.springs) {
    draw_springs(picture, sheet_, state_, options_.ablation.loss_mass);
  }
}

StageResult StrainStage::end(Step& step) {
  step.strain = motion_.weave_strain();
  if (step.strain->largest > state_.record[0]) {
    state_.record << step.strain->largest, step.strain->place, state_.time + step.h;
  }
  return {};
}

void StrainStage::report(Report& report, const Step& step) const {
  const WeaveStrain net = step.strain ? *step.strain : motion_.weave_strain();
  for (std::size_t colour = 0; colour < 4; ++colour) {
    report.add(std::string("strain_max_") + colour_names[colour], "", net.largest_of[colour]);
    report.add(std::string("strain_rms_") + colour_names[colour], "", net.rms_of[colour]);
  }
  report.add("largest_strain", "", net.largest);
  report.add("largest_strain_id_1", "", static_cast<double>(net.ids[0]));
  report.add("largest_strain_id_2", "", static_cast<double>(net.ids[1]));
  report.add("largest_strain_x", "m", net.place[0]);
  report.add("largest_strain_y", "m", net.place[1]);
  report.add("largest_strain_z", "m", net.place[2]);
  report.add("mean_strain", "", net.mean);
}

std::vector<std::string> StrainStage::remarks() const {
  const Eigen::VectorXd& record = state_.record;
  if (record[0] < 0) {  // There has been no step.
    return {};
  }
  return {"largest strain of the net: " + words_of(record[0], record.segment<3>(1)) + ", " + time_text(record[4])};
}

}  // namespace pellicle::world
