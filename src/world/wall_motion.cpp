#include "world/wall_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "combustion/combustion.h"
#include "energies/vertex_potential.h"
#include "parallel/collective.h"
#include "surface/membrane.h"

namespace pellicle::world {

namespace {

/// The stiffness of contact that suits the means of the wall [Pa/m]. Collective.
double stiffness_of_contact(const Membrane& membrane, const Wall& wall, const Options& options) {
  std::array<double, 3> sums{};  // of area, of mass, of 6 mu h, the tension of rubber that is drawn out far
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    const double area = wall.rest[e].area;
    sums[0] += area;
    sums[1] += area * wall.thickness[e] * wall.density[e];
    sums[2] += area * wall.thickness[e] * 6 * small_strain_moduli(wall.material_of(e)).shear;
  }
  sums = sum_over_ranks(membrane.comm(), sums);
  const bool is_static = options.time.scheme == TimeScheme::statics || !options.prism.inertia;
  return usual_contact_stiffness(membrane, sums[2] / sums[0], is_static ? 0 : sums[1] / sums[0], options.time.step);
}

}  // namespace

Wall wall_of(const Membrane& membrane, const Options& options, Textures& textures) {
  return make_wall(membrane, options.wall,
                   textures.values(membrane.element_uv, "wall.thickness_texture", options.wall.thickness_texture));
}

WallMotion::WallMotion(const Membrane& membrane, const Options& options, State& state, StageClock& clock,
                       Textures& textures, Constraints constraints, GasStage& gas)
    : SurfaceMotion(membrane, options, state, clock, gas.chambers().count() > 0 ? &gas : nullptr,
                    integrator_of(options.time)),
      membrane_(membrane),
      constraints_(std::move(constraints)),
      wall_(wall_of(membrane, options, textures)),
      elements_(membrane, wall_),
      loads_(membrane, vertex_areas(membrane), options.attachments, options.forces, state.loads) {
  set_contact(stiffness_of_contact(membrane, wall_, options));
  mass_ = vertex_masses(membrane, wall_);
  if (state.burning) {
    hold_ = make_vertex_potential(membrane.particles, [this](PetscInt i, const Eigen::Vector3d& x) {
      // As if it had its mass and no velocity.
      const double stiffness = mass_[i] == 0 ? membrane_.initial_mass[i] / (h_ * h_) : 0;
      const Eigen::Vector3d away = x - start_.vector(i);
      return PointPotential{stiffness / 2 * away.squaredNorm(), stiffness * away,
                            stiffness * Eigen::Matrix3d::Identity()};
    });
  }
  if (air_) {
    drag_ = make_drag_potential(
        membrane.particles, *air_, start_, [this] { return wall_part_->rate(); },
        [this](PetscInt i) { return wall_part_->y_v(i); });
  }
  if (gas_ != nullptr && gas_->uneven_forces() != nullptr) {
    buoyancy_ = make_vertex_potential(membrane.particles, [this](PetscInt i, const Eigen::Vector3d& x) {
      const Eigen::Vector3d force = gas_->uneven_forces()->vector(i);
      return PointPotential{-force.dot(x - start_.vector(i)), -force};
    });
  }
  const Projectors& projectors = constraints_.projectors;
  if (options.wall.bends()) {
    bending_.emplace(elements_, projectors, pins_.clamped());
  }
  // It is made for the wall as it was, whatever has happened to it.
  elements_.set_burnt({}, {});
  const std::vector<Potential*> others =
      present({bending_ ? &*bending_ : nullptr, hold_.get(), drag_.get(), buoyancy_.get(), body_contact_.get()});
  wall_part_.emplace(WallModel{elements_, constraints_, pins_, loads_, mass_, options.force.gravity, others},
                     options.prism, integrator_);
  set_part(
      *wall_part_, mass_, [this](double time) { wall_part_->set_time(time); },
      [this](std::vector<double> pressure) {
        wall_part_->set_load(std::move(pressure), gas_->chambers().rims().sides());
      });
  if (wall_.preserve_volume) {
    volume_preservation_ = std::make_unique<VolumePreservation>(membrane, wall_, projectors, options.volume);
  }
}

std::vector<bool> WallMotion::constrained() const {
  const Projectors& projectors = constraints_.projectors;
  std::vector<bool> constrained(projectors.size(), false);
  for (const PetscInt i : projectors.bound()) {
    constrained[i] = true;
  }
  return constrained;
}

void WallMotion::start() {
  elements_.update_thickness(state_.position, state_.thickness_ratio);
  set_pressures(state_.time_of_loads());
}

StageResult WallMotion::begin(Step& step) {
  h_ = step.h;
  std::vector<bool> still = pinned();
  for (PetscInt i = 0; i < membrane_.particles.local(); ++i) {
    if (has_left(i)) {
      state_.velocity.vector(i).setZero();
      still[i] = true;
    }
  }
  update_derived();
  start_.values() = state_.position.values();
  start_velocity_.values() = state_.velocity.values();
  const auto timer = clock_.time("implicit step");
  if (bending_) {
    bending_->begin_step(state_.position, state_.thickness_ratio);
  }
  begin_acceleration(still);
  set_drag(integrator_.fraction());
  begin_bodies(still, time_of_balance(), integrator_.fraction() * h_);
  wall_part_->begin_step(state_.position, start_of_step());
  begin_gas_and_path(time_of_balance());
  return {};
}

/// The accelerations from which the first step goes on, if they count. Collective.
void WallMotion::begin_acceleration(const std::vector<bool>& still) {
  if (state_.acceleration == nullptr || state_.step > 0) {
    return;
  }
  state_.acceleration->values().setZero();
  set_drag(0);
  begin_bodies(still, state_.time, h_);
  Eigen::Matrix3Xd force = wall_part_->forces_at(state_.position, start_of_step());
  if (filled_) {
    Eigen::Matrix3Xd of_gas = filled_->forces_at(state_.time);
    constraints_.projectors.apply(of_gas);
    force += of_gas;
  }
  for (PetscInt i = 0; i < membrane_.particles.owned; ++i) {
    state_.acceleration->vector(i) = force.col(i) / mass_[i];
  }
  state_.acceleration->update_ghosts();
}

StageResult WallMotion::take_balance(Step& step) {
  const auto timer = clock_.time("implicit step");
  step.newton_iterations = step.balance.newton_iterations;
  step.motion_iterations = step.balance.linear_iterations;
  std::string fault;
  write_end(state_.position);
  if (integrator_.fraction() != 1 && wall_part_->inverted(start_, state_.position) > 0) {
    fault = "the end of the step turns elements over: it is too long";
  }
  if (filled_) {
    state_.pressure(filled_->prescribed()) = filled_->multiplier();
  }
  if (fault.empty() && body_contact_ != nullptr) {
    step.loads = body_contact_->loads(part_->position());
    fault = body_contact_->sweep().fault(step.loads);
  }
  if (const StageResult failed = result_of(std::move(fault)); !failed.converged) {
    return failed;
  }
  keep_what_has_left();
  elements_.update_thickness(state_.position, state_.thickness_ratio);
  add_work();
  return {};
}

void WallMotion::write_end(Field& position) const {
  if (integrator_.fraction() == 1) {
    position.values() = part_->position().values();
  } else {
    SurfaceMotion::write_end(position);
  }
}

/// Adds the works of the step, by the forces with which it is in balance. Collective.
void WallMotion::add_work() {
  const Eigen::Matrix3Xd of_gas = filled_ ? filled_->pressure_forces() : Eigen::Matrix3Xd();
  const StepWork work = wall_part_->work(state_.position, start_velocity_, of_gas);
  const auto work_of = [this](const Potential* potential) {
    return potential != nullptr ? wall_part_->work_of(*potential, state_.position) : 0;
  };
  std::array<double, 3> of_others{work_of(drag_.get()), work_of(buoyancy_.get()), work_of(body_contact_.get())};
  of_others = sum_over_ranks(membrane_.comm(), of_others);
  of(state_.work, Work::gravity) += work.gravity;
  of(state_.work, Work::damping) += work.damping;
  of(state_.work, Work::pins) += work.pins;
  of(state_.work, Work::pressure) += work.pressure + of_others[1];
  of(state_.work, Work::bodies) += of_others[2];
  of(state_.work, Work::air) += of_others[0];
  of(state_.work, Work::loads) += work.loads;
}

StageResult WallMotion::end(Step& step) {
  if (volume_preservation_ != nullptr) {
    const auto timer = clock_.time("volume preservation");
    const StageResult preserved = volume_preservation_->advance(state_.position, state_.thickness_ratio);
    if (!preserved.converged) {
      return preserved;
    }
  }
  {
    const auto timer = clock_.time("velocity");
    end_path();
    set_pressures(end_of_loads());
    step.error = max_over_ranks(membrane_.comm(), find_end(pinned()) / part_->length_scale());
    step.inverted = sum_over_ranks(membrane_.comm(), elements_.inverted(start_, state_.position));
  }
  if (body_contact_ != nullptr && body_contact_->rebounds() && options_.time.scheme == TimeScheme::implicit_euler) {
    rebound(step.loads);
  }
  const auto record = [this](StepRecord kind) -> double& { return of(state_.record, kind); };
  const double number = static_cast<double>(state_.step + 1);
  record(StepRecord::last_residual) = step.balance.relative_residual;
  if (step.balance.is_above_tolerance) {
    ++record(StepRecord::above_tolerance);
    if (step.balance.relative_residual > record(StepRecord::worst_residual)) {
      record(StepRecord::worst_residual) = step.balance.relative_residual;
      record(StepRecord::worst_step) = number;
    }
  }
  if (step.balance.concave_iterations > 0 && ++record(StepRecord::concave_steps) == 1) {
    record(StepRecord::first_concave_step) = number;
  }
  if (step.balance.is_factorised && ++record(StepRecord::factorised_steps) == 1) {
    step.news.push_back(fmt::format("step {}: the tangent is factorised (prism.factor)", number));
  }
  return {};
}

/// Sets mass and stiffness of the wall from what has burnt.
void WallMotion::update_derived() {
  if (!state_.burning) {
    return;
  }
  const BurningFields& fields = *state_.burning;
  std::copy_n(fields.mass.data(), mass_.size(), mass_.begin());
  const CombustionOptions& combustion = options_.combustion;
  std::vector<double> stiffness;
  std::vector<double> length;
  for (std::size_t e = 0; e < membrane_.triangles.size(); ++e) {
    double ratio = 0;
    double temperature = 0;
    for (const PetscInt vertex : membrane_.triangles[e]) {
      const double mass = fields.mass.data()[vertex];
      ratio += (mass > 0 ? mass / membrane_.initial_mass[vertex] : combustion.min_mass) / 3;
      temperature += fields.temperature.data()[vertex] / 3;
    }
    const double char_stiffness = 1 + (combustion.char_stiffness - 1) * burnt_share(ratio, combustion);
    const std::optional<double> reference = options_.wall.reference_temperature;
    const double warmth = reference ? temperature / *reference : 1;
    stiffness.push_back(fields.active.triangles[e] ? char_stiffness * warmth : 0);
    length.push_back(volume_ratio(ratio, combustion));
  }
  elements_.set_burnt(std::move(stiffness), length);
}

/// Pressures of the gas where the wall is, at a time of the loads [s]; prescribed volumes keep their multipliers.
/// Collective.
void WallMotion::set_pressures(double time) {
  if (gas_ == nullptr) {
    return;
  }
  const Chambers& chambers = gas_->chambers();
  const std::vector<GasState> gas = chambers.states(gas_->exchange(), chambers.volumes(state_.position), time);
  for (int chamber = 0; chamber < chambers.count(); ++chamber) {
    if (!chambers.prescribes_volume(chamber)) {
      state_.pressure[chamber] = gas[chamber].pressure;
    }
  }
}

const std::vector<Eigen::Matrix3d>& WallMotion::stress() {
  stress_ = elements_.tensions(state_.position, state_.thickness_ratio);
  for (std::size_t e = 0; e < stress_.size() && options_.wall.strength; ++e) {
    stress_[e] /= wall_.thickness[e] * state_.thickness_ratio[e];
  }
  return stress_;
}

std::string WallMotion::progress(const Step& /*step*/) const {
  return state_.pressure.size() > 0 ? fmt::format("p {:.4g} Pa", state_.pressure[0]) : "";
}

void WallMotion::report(Report& report, const Step& step) const {
  std::array<double, 3> sums{elements_.volume(state_.position, state_.thickness_ratio),
                             elements_.energy(state_.position, state_.thickness_ratio) +
                                 (bending_ ? bending_->energy(state_.position, state_.thickness_ratio) : 0),
                             0};
  // The largest values, and the negatives of the least, of thickness, thickness ratio and an element's volume ratio.
  Eigen::Array<double, 3, 2> maxima = Eigen::Array<double, 3, 2>::Constant(-HUGE_VAL);
  for (PetscInt e = 0; e < membrane_.elements.owned; ++e) {
    sums[2] += wall_.rest[e].volume;
    if (elements_.stiffness(e) == 0) {
      continue;
    }
    const double ratio = state_.thickness_ratio[e];
    const auto [e12, e13] = edges_of(state_.position.data(), membrane_.triangles[e]);
    const double area = e12.cross(e13).norm() / 2;
    const Eigen::Array3d values(wall_.thickness[e] * ratio, ratio, ratio * area / wall_.rest[e].area);
    maxima.col(0) = maxima.col(0).max(values);
    maxima.col(1) = maxima.col(1).max(-values);
  }
  const auto [volume, energy, undeformed_volume] = sum_over_ranks(membrane_.comm(), sums);
  max_over_ranks(membrane_.comm(), maxima);
  if (maxima(0, 0) < 0) {  // Nothing is left.
    maxima.setZero();
  }
  report.add("rubber_volume_ratio", "", volume / undeformed_volume);
  report.add("thickness_min", "m", -maxima(0, 1));
  report.add("thickness_max", "m", maxima(0, 0));
  report.add("thickness_ratio_min", "", -maxima(1, 1));
  report.add("thickness_ratio_max", "", maxima(1, 0));
  report.add("element_volume_ratio_min", "", -maxima(2, 1));
  report.add("element_volume_ratio_max", "", maxima(2, 0));
  report.add("inverted_elements", "", static_cast<double>(step.inverted));
  report.add("newton_iterations", "", step.newton_iterations);
  report.add("linear_iterations", "", step.motion_iterations);
  report.add("concave_iterations", "", step.balance.concave_iterations);
  report.add("residual", "N", step.balance.residual);
  report.add("relative_residual", "", step.balance.relative_residual);
  report.add("elastic_energy", "J", energy);
  if (state_.load_time != nullptr) {
    report.add("load_time", "s", *state_.load_time);
  }
}

void WallMotion::draw(Picture& picture) const {
  const std::size_t elements = membrane_.triangles.size();
  std::vector<double> thickness(elements);
  std::vector<double> stretch(2 * elements);
  std::vector<double> stress(2 * elements);
  for (std::size_t e = 0; e < elements; ++e) {
    if (elements_.stiffness(e) == 0) {
      continue;
    }
    const auto [e12, e13] = edges_of(state_.position.data(), membrane_.triangles[e]);
    thickness[e] = wall_.thickness[e] * state_.thickness_ratio[e];
    const PrincipalState principal = elements_.principal(e, e12, e13, state_.thickness_ratio[e]);
    Eigen::Map<Eigen::Vector2d>(stretch.data() + 2 * e) = principal.stretch;
    Eigen::Map<Eigen::Vector2d>(stress.data() + 2 * e) = principal.stress;
  }
  picture.add_on_cells("thickness", std::move(thickness));
  picture.add_on_cells("stretch", std::move(stretch), 2);
  picture.add_on_cells("stress", std::move(stress), 2);
}

std::vector<std::string> WallMotion::remarks() const {
  const auto record = [this](StepRecord kind) { return of(state_.record, kind); };
  std::vector<std::string> lines;
  if (record(StepRecord::above_tolerance) > 0) {
    lines.push_back(fmt::format(
        "residual: {} of {} steps ended above {}: out of balance by {:.2g} of their forces at worst, in step "
        "{}, and by {:.2g} in the last one",
        record(StepRecord::above_tolerance), state_.step,
        options_.prism.newton == NewtonEnd::converged
            ? "prism.snes_rtol, as far as the rounding of the places lets Newton's method go"
            : "prism.residual_tolerance",
        record(StepRecord::worst_residual), record(StepRecord::worst_step), record(StepRecord::last_residual)));
  }
  if (record(StepRecord::concave_steps) > 0) {
    lines.push_back(fmt::format(
        "equilibria: in {} of {} steps, first in step {}, the tangent was not positive definite (history.csv: "
        "concave_iterations): such a step may have several equilibria, and with another length find another",
        record(StepRecord::concave_steps), state_.step, record(StepRecord::first_concave_step)));
  }
  if (record(StepRecord::factorised_steps) > 0) {
    lines.push_back(
        fmt::format("linear solver: the tangent was factorised in {} steps", record(StepRecord::factorised_steps)));
  }
  return lines;
}

}  // namespace pellicle::world
