#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "combustion/combustion.h"
#include "elastic/elastic_sheet.h"
#include "elastic/spring_sheet.h"
#include "energies/vertex_potential.h"
#include "io/texture.h"
#include "parallel/collective.h"
#include "world/sheet_motion.h"

namespace pellicle::world {

namespace {

/// The stiffness of contact in steps of the deck's length [Pa/m]. @param tensile_stiffness of the sheet [N/m]
double stiffness_of_contact(const Sheet& sheet, const Options& options, double tensile_stiffness) {
  constexpr double strain = 0.05;  // as much as a sheet may bear
  const bool is_static = options.time.scheme == TimeScheme::statics;
  return usual_contact_stiffness(sheet, strain * tensile_stiffness, is_static ? 0 : options.sheet.areal_density,
                                 options.time.step);
}

/// The motion of a sheet that resists changes of its shape (SheetPart): its own forces, bodies, drag of the air and gas
/// are brought into balance. By statics (TimeOptions::scheme) each step ends at rest; by generalized alpha forces are
/// in balance within the step, which starts from accelerations, too (TimeIntegrator).
class BalancedMotion : public SheetMotion {
 public:
  void update_derived() override;
  void report(Report& report, const Step& step) const override;

  std::string passed_limit() const override;

 protected:
  /// All must outlive it. Collective. @param contact_stiffness see SheetMotion
  BalancedMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas,
                 double contact_stiffness);
  /// To be called once, with a part that outlives this object.
  void set_sheet_part(SheetPart& part);
  /// The potentials of the positions other than those of the part: bodies, drag and weight, as far as there are any.
  std::vector<Potential*> others() const { return present({body_contact_.get(), drag_.get(), weight_.get()}); }

  StageResult begin_balance(Step& step) override;
  StageResult find_positions(Step& step) override;
  Eigen::Matrix3Xd gas_forces() override { return filled_->pressure_forces(); }
  void add_own_forces(Eigen::Matrix3Xd& sum) override {
    for (const Potential* potential : sheet_part_->of_shape()) {
      sum += forces_of(*potential);
    }
  }
  double viscous_work() const override {
    const double lasting = integrator_.is_second_order() ? integrator_.rate(h_) * h_ : 1;
    return lasting * sheet_part_->viscous_work(state_.position);
  }
  void move_freely() override;
  Eigen::Vector3d velocity_of_balance(PetscInt i) const override {
    return integrator_.is_second_order()
               ? Eigen::Vector3d(integrator_.rate(h_) * (state_.position.vector(i) - y_v_.vector(i)))
               : SheetMotion::velocity_of_balance(i);
  }
  void move_to_end() override {
    if (integrator_.is_second_order()) {
      write_end(state_.position);
      keep_what_has_left();
    }
  }
  void find_velocities(Step& step) override;

 private:
  SheetInput input(double h) const;
  void set_burnt();
  void begin_acceleration();
  std::optional<Field> forces_of_uneven_gas() const {
    const bool is_there = gas_ != nullptr && gas_->uneven_forces() != nullptr;
    return is_there ? std::optional<Field>(borne_forces(*gas_->uneven_forces())) : std::nullopt;
  }

  SheetPart* sheet_part_ = nullptr;  ///< not null after set_sheet_part
  Field y_v_;                        ///< of generalized alpha (TimeIntegrator)
  double pull_ = 0;                  ///< of generalized alpha: inertia and damping pull by mass times this [1/s^2]

  std::unique_ptr<Potential> weight_;  ///< in a step of statics; else null
  std::unique_ptr<Potential> drag_;    ///< null: there is no air
  std::vector<double> holding_;        ///< of statics, in place of masses [kg]
  std::vector<double> stiffness_factor_;
};

/// The motion of a sheet of Hooke springs (SpringSheet).
class SpringMotion : public BalancedMotion {
 public:
  /// All must outlive it. Collective.
  SpringMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas);

  const std::vector<Eigen::Matrix3d>& stress() override {
    return spring_stress_->find(state_.burning->active, springs_->spring_forces(state_.position), state_.position);
  }

 private:
  std::optional<SpringSheet> springs_;
};

/// The motion of a sheet as a material (ElasticSheet).
class ElasticMotion : public BalancedMotion {
 public:
  /// All must outlive it. Collective. @throws Error on textures that cannot be read
  ElasticMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, Textures& textures,
                GasStage* gas);

  std::vector<std::string> first_remarks() const override;

  void set_lengths() override {
    set_volume_ratios(volume_ratio_, sheet_, state_.burning->mass, options_.combustion);
    set_surface_lengths(state_.target_length, sheet_, state_.burning->active, volume_ratio_);
  }
  const std::vector<Eigen::Matrix3d>& stress() override {
    stress_ = elastic_->stress(state_.position);
    return stress_;
  }

 protected:
  StageResult begin_balance(Step& step) override;

 private:
  std::optional<ElasticSheet> elastic_;
  std::vector<Eigen::Matrix3d> stress_;
};

}  // namespace

SpringMotion::SpringMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas)
    : BalancedMotion(sheet, options, state, clock, gas,
                     stiffness_of_contact(sheet, options, options.spring.stiffness)) {
  SpringOptions spring = options.spring;
  spring.damping = is_static() ? 0 : spring.damping;
  set_sheet_part(springs_.emplace(sheet, spring, pins_.pinned(), options.time.step, others()));
}

BalancedMotion::BalancedMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock,
                               GasStage* gas, double contact_stiffness)
    : SheetMotion(sheet, options, state, clock, gas, contact_stiffness, integrator_of(options.time)) {
  if (integrator_.is_second_order()) {
    y_v_ = Field(sheet.particles, 3);
  }
  if (air_) {
    drag_ = make_drag_potential(
        sheet.particles, *air_, start_, [this] { return h_ > 0 ? integrator_.rate(h_) : 0; },
        [this](PetscInt i) { return (integrator_.is_second_order() ? y_v_ : start_).vector(i); });
  }
  if (is_static()) {
    weight_ = make_vertex_potential(sheet.particles, [this](PetscInt i, const Eigen::Vector3d& x) {
      const Eigen::Vector3d weight = mass_[i] * options_.force.gravity;
      return PointPotential{-weight.dot(x - start_.vector(i)), -weight};
    });
  }
}

void BalancedMotion::set_sheet_part(SheetPart& part) {
  sheet_part_ = &part;
  const auto set_time = [this](double /*time*/) { sheet_part_->forget(); };
  set_part(part, sheet_.initial_mass, set_time);
}

void BalancedMotion::update_derived() {
  SheetMotion::update_derived();
  start_.values() = state_.position.values();
  set_burnt();
  sheet_part_->set_shape(input(options_.time.step));
}

/// Sets what follows from the burnt fractions. Char is softer, linearly in the fraction that has burnt.
void BalancedMotion::set_burnt() {
  set_volume_ratios(volume_ratio_, sheet_, state_.burning->mass, options_.combustion);
  stiffness_factor_.assign(sheet_.particles.local(), 1);
  for (std::size_t i = 0; i < stiffness_factor_.size() && options_.combustion.char_stiffness != 1; ++i) {
    stiffness_factor_[i] += (options_.combustion.char_stiffness - 1) *
                            burnt_share(state_.burning->mass.data()[i] / sheet_.initial_mass[i], options_.combustion);
  }
}

SheetInput BalancedMotion::input(double h) const {
  const double to_balance = integrator_.fraction() * h;
  const bool is_alpha = integrator_.is_second_order() && pull_ > 0;
  return {{is_static() ? holding_ : mass_, start_, to_balance, is_alpha ? 1 / std::sqrt(pull_) : to_balance},
          state_.target_length,
          volume_ratio_,
          stiffness_factor_,
          state_.burning->active,
          is_alpha ? y_v_ : start_,
          is_alpha ? 1 / integrator_.rate(h) : to_balance};
}

void BalancedMotion::move_freely() {
  if (!integrator_.is_second_order()) {
    SheetMotion::move_freely();
    return;
  }
  damping_ = velocity_damping(options_);
  begin_acceleration();
  const auto timer = clock_.time("external force");
  const double inertia = integrator_.inertia(h_);
  const double rate = damping_ * integrator_.rate(h_);
  const double fraction = integrator_.fraction();
  const std::optional<Field> uneven = forces_of_uneven_gas();
  pull_ = inertia + rate;
  pins_.impose(state_.position, state_.time + h_);
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    const Eigen::Vector3d start = start_.vector(i);
    const Kinematics before = start_of(i);
    y_v_.vector(i) = start + integrator_.y_v(h_, before);
    if (constrained_[i]) {  // What is pinned moves evenly, whatever its velocity was; what has left stays.
      const Eigen::Vector3d end = state_.position.vector(i);
      state_.position.vector(i) = start + fraction * (end - start);
      y_v_.vector(i) = state_.position.vector(i) - (end - start) / (integrator_.rate(h_) * h_);
      continue;
    }
    // Inertia, damping and weight pull together towards this place.
    Eigen::Vector3d force = options_.force.gravity;
    if (uneven) {
      force += uneven->vector(i) / mass_[i];
    }
    state_.position.vector(i) =
        start + (inertia * integrator_.y_a(h_, before) + rate * integrator_.y_v(h_, before) + force) / pull_;
  }
  if (uneven) {
    uneven_ = uneven->values().leftCols(sheet_.particles.owned);
  }
  set_drag(fraction);
}

/// The accelerations from which the first step goes on. Collective.
void BalancedMotion::begin_acceleration() {
  if (state_.step > 0) {
    return;
  }
  y_v_.values() = start_.values() - start_velocity_.values() / integrator_.rate(h_);
  state_.acceleration->values().setZero();
  set_drag(0);
  set_burnt();
  begin_bodies(constrained_, state_.time, h_);
  pull_ = integrator_.inertia(h_);
  sheet_part_->begin(start_, input(h_));
  sheet_part_->move_to(start_, {});  // Contact may have moved it.
  Eigen::Matrix3Xd force = -sheet_part_->gradient();
  if (filled_) {
    force += filled_->forces_at(state_.time);
  }
  const std::optional<Field> uneven = forces_of_uneven_gas();
  for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
    if (!constrained_[i]) {
      state_.acceleration->vector(i) =
          force.col(i) / mass_[i] + options_.force.gravity - damping_ * start_velocity_.vector(i);
      if (uneven) {
        state_.acceleration->vector(i) += uneven->vector(i) / mass_[i];
      }
    }
  }
  state_.acceleration->update_ghosts();
  follow(*state_.acceleration);
}

StageResult BalancedMotion::begin_balance(Step& step) {
  set_burnt();
  if (is_static()) {
    holding_.assign(mass_.size(), sheet_part_->holding_stiffness() * h_ * h_);
  }
  const auto timer = clock_.time("projection");
  begin_bodies(constrained_, time_of_balance(), integrator_.fraction() * h_);
  sheet_part_->begin(state_.position, input(step.h));
  begin_gas_and_path(end_of_loads() - (1 - integrator_.fraction()) * step.h);
  return {};
}

StageResult BalancedMotion::find_positions(Step& step) {
  StageResult result = take_positions(*part(), step);
  if (filled_) {
    state_.pressure = filled_->pressures();
  }
  end_path();
  return result;
}

void BalancedMotion::find_velocities(Step& step) {
  if (!integrator_.is_second_order()) {
    SheetMotion::find_velocities(step);
    return;
  }
  const auto timer = clock_.time("velocity");
  const double error = find_end(constrained_);
  follow(state_.position);
  follow(state_.velocity);
  follow(*state_.acceleration);
  if (options_.time.tolerance > 0) {
    step.error = max_over_ranks(sheet_.comm(), error) / size_;
  }
}

std::string BalancedMotion::passed_limit() const {
  if (!options_.project.strain_limit) {
    return "";
  }
  const WeaveStrain strain =
      surface::weave_strain(sheet_, sheet_part_->position(), state_.target_length, state_.burning->active);
  return strain.largest <= *options_.project.strain_limit ? "" : beyond_limit(strain, *options_.project.strain_limit);
}

void BalancedMotion::report(Report& report, const Step& step) const {
  SheetMotion::report(report, step);
  report.add("elastic_energy", "J", sheet_part_->elastic_energy(state_.position));
  if (path_) {
    report.add("load_time", "s", *state_.load_time);
  }
}

ElasticMotion::ElasticMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock,
                             Textures& textures, GasStage* gas)
    : BalancedMotion(sheet, options, state, clock, gas,
                     stiffness_of_contact(sheet, options, stiffness_of(options.material).tensile[0])) {
  SheetMaterial material = options.material;
  material.damping = is_static() ? 0 : material.damping;
  const auto factors = [&](const char* key, const std::string& file) {
    return textures.values(sheet.uv, key, file, material.stiffness_range);
  };
  const MaterialFactors stiffness{factors("sheet.tensile_texture", material.tensile_texture),
                                  factors("sheet.shear_texture", material.shear_texture),
                                  factors("sheet.bending_texture", material.bending_texture)};
  set_sheet_part(elastic_.emplace(sheet, material, options.sheet.thickness, stiffness, pins_.pinned(), pins_.clamped(),
                                  elastic_options(options), others()));
}

StageResult ElasticMotion::begin_balance(Step& step) {
  if (step.has_burnt) {
    set_lengths();  // They follow from what is left, too.
  }
  return BalancedMotion::begin_balance(step);
}

std::vector<std::string> ElasticMotion::first_remarks() const {
  constexpr double thin = 1e-3;     // [m]
  constexpr double of_paper = 3e9;  // [Pa]
  std::vector<std::string> lines;
  const SheetMaterial& material = options_.material;
  const double thickness = options_.sheet.thickness;
  if (!material.young_modulus && !material.tensile_stiffness && thickness <= thin) {
    lines.push_back(fmt::format(
        "sheet.tensile_stiffness: {:.4g} N/m, the default, not that of a material {:.3g} m thick (sheet.thickness): "
        "such paper has some {:.1g} N/m; expected sheet.young_modulus with sheet.physical_thickness, or stiffnesses",
        stiffness_of(material).tensile[0], thickness, of_paper * thickness));
  }
  return lines;
}

std::unique_ptr<SheetMotion> make_sheet_motion(const Sheet& sheet, const Options& options, State& state,
                                               StageClock& clock, Textures& textures, GasStage* gas) {
  if (options.dynamics == Dynamics::projection) {
    return make_projected_motion(sheet, options, state, clock, textures, gas);
  }
  if (options.dynamics == Dynamics::spring) {
    return std::make_unique<SpringMotion>(sheet, options, state, clock, gas);
  }
  return std::make_unique<ElasticMotion>(sheet, options, state, clock, textures, gas);
}

}  // namespace pellicle::world
