#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "combustion/combustion.h"
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

/// The motion of a sheet of Hooke springs: springs, bodies, drag of the air and gas are brought into balance. By
/// statics (TimeOptions::scheme) each step ends at rest; by generalized alpha forces are in balance within the
/// step, which starts from accelerations, too (TimeIntegrator).
class SpringMotion : public SheetMotion {
 public:
  /// All must outlive it. Collective.
  SpringMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas);

  void update_derived() override;
  void report(Report& report, const Step& step) const override;

  std::string passed_limit() const override;
  const std::vector<Eigen::Matrix3d>& stress() override {
    return spring_stress_->find(state_.burning->active, springs_->spring_forces(state_.position), state_.position);
  }

 protected:
  /// @param contact_stiffness see SheetMotion; `set_springs` must follow
  SpringMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas,
               double contact_stiffness);
  void set_springs(std::unique_ptr<SpringSheet> springs);
  /// The potentials of the positions other than those of the springs: bodies, drag and weight, as far as there are any.
  std::vector<Potential*> others() const { return present({body_contact_.get(), drag_.get(), weight_.get()}); }

  StageResult begin_balance(Step& step) override;
  StageResult find_positions(Step& step) override;
  Eigen::Matrix3Xd gas_forces() override { return filled_->pressure_forces(); }
  void add_spring_forces(Eigen::Matrix3Xd& sum) override {
    for (const Potential* potential : springs_->of_shape()) {
      sum += forces_of(*potential);
    }
  }
  double viscous_work() const override {
    const double lasting = integrator_.is_second_order() ? integrator_.rate(h_) * h_ : 1;
    return lasting * springs_->viscous_work(state_.position);
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

  std::unique_ptr<SpringSheet> springs_;

 private:
  SheetInput input(double h) const;
  void set_burnt();
  void begin_acceleration();

  Field y_v_;        ///< of generalized alpha (TimeIntegrator)
  double pull_ = 0;  ///< of generalized alpha: inertia and damping pull by mass times this [1/s^2]

  std::unique_ptr<Potential> weight_;  ///< in a step of statics; else null
  std::unique_ptr<Potential> drag_;    ///< null: there is no air
  std::vector<double> holding_;        ///< of statics, in place of masses [kg]
  std::vector<double> stiffness_factor_;
};

/// The motion of a sheet as a material (ElasticSheet).
class ElasticMotion : public SpringMotion {
 public:
  /// All must outlive it. Collective. @throws Error on textures that cannot be read
  ElasticMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, Textures& textures,
                GasStage* gas);

  std::vector<std::string> first_remarks() const override;

  void set_lengths() override {
    set_volume_ratios(volume_ratio_, sheet_, state_.burning->mass, options_.combustion);
    set_surface_lengths(state_.target_length, sheet_, state_.burning->active, volume_ratio_);
  }
  WeaveStrain weave_strain() const override {
    return surface::weave_strain(sheet_, state_.position, state_.target_length, state_.burning->active,
                                 springs_->bearing_springs(state_.burning->active));
  }

 protected:
  StageResult begin_balance(Step& step) override;

 private:
  double largest_excess_;  ///< see ElasticSheet::largest_excess
};

}  // namespace

SpringMotion::SpringMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas)
    : SpringMotion(sheet, options, state, clock, gas, stiffness_of_contact(sheet, options, options.spring.stiffness)) {
  SpringOptions spring = options.spring;
  spring.damping = is_static() ? 0 : spring.damping;
  set_springs(std::make_unique<SpringSheet>(sheet, spring, pins_.pinned(), options.time.step, others()));
}

SpringMotion::SpringMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas,
                           double contact_stiffness)
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

void SpringMotion::set_springs(std::unique_ptr<SpringSheet> springs) {
  springs_ = std::move(springs);
  const auto set_time = [this](double /*time*/) { springs_->forget(); };
  set_part(*springs_, sheet_.initial_mass, set_time);
}

void SpringMotion::update_derived() {
  SheetMotion::update_derived();
  start_.values() = state_.position.values();
  mass_.assign(mass(), mass() + sheet_.particles.local());
  set_burnt();
  springs_->set_shape(input(options_.time.step));
}

/// Sets what follows from the burnt fractions. Char is softer, linearly in the fraction that has burnt.
void SpringMotion::set_burnt() {
  set_volume_ratios(volume_ratio_, sheet_, state_.burning->mass, options_.combustion);
  stiffness_factor_.assign(sheet_.particles.local(), 1);
  for (std::size_t i = 0; i < stiffness_factor_.size() && options_.combustion.char_stiffness != 1; ++i) {
    stiffness_factor_[i] +=
        (options_.combustion.char_stiffness - 1) * burnt_share(mass()[i] / sheet_.initial_mass[i], options_.combustion);
  }
}

SheetInput SpringMotion::input(double h) const {
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

void SpringMotion::move_freely() {
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
  const Field* uneven = gas_ != nullptr ? gas_->uneven_forces() : nullptr;
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
    if (uneven != nullptr) {
      force += uneven->vector(i) / mass_[i];
    }
    state_.position.vector(i) =
        start + (inertia * integrator_.y_a(h_, before) + rate * integrator_.y_v(h_, before) + force) / pull_;
  }
  if (uneven != nullptr) {
    uneven_ = uneven->values().leftCols(sheet_.particles.owned);
  }
  set_drag(fraction);
}

/// The accelerations from which the first step goes on. Collective.
void SpringMotion::begin_acceleration() {
  if (state_.step > 0) {
    return;
  }
  y_v_.values() = start_.values() - start_velocity_.values() / integrator_.rate(h_);
  state_.acceleration->values().setZero();
  set_drag(0);
  set_burnt();
  begin_bodies(constrained_, state_.time, h_);
  pull_ = integrator_.inertia(h_);
  springs_->begin(start_, input(h_));
  springs_->move_to(start_, {});  // Contact may have moved it.
  Eigen::Matrix3Xd force = -springs_->gradient();
  if (filled_) {
    force += filled_->forces_at(state_.time);
  }
  for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
    if (!constrained_[i]) {
      state_.acceleration->vector(i) =
          force.col(i) / mass_[i] + options_.force.gravity - damping_ * start_velocity_.vector(i);
      if (gas_ != nullptr && gas_->uneven_forces() != nullptr) {
        state_.acceleration->vector(i) += gas_->uneven_forces()->vector(i) / mass_[i];
      }
    }
  }
  state_.acceleration->update_ghosts();
}

StageResult SpringMotion::begin_balance(Step& step) {
  set_burnt();
  if (is_static()) {
    holding_.assign(mass_.size(), springs_->holding_stiffness() * h_ * h_);
  }
  const auto timer = clock_.time("projection");
  begin_bodies(constrained_, time_of_balance(), integrator_.fraction() * h_);
  springs_->begin(state_.position, input(step.h));
  begin_gas_and_path(end_of_loads() - (1 - integrator_.fraction()) * step.h);
  return {};
}

StageResult SpringMotion::find_positions(Step& step) {
  StageResult result = take_positions(*part(), step);
  if (filled_) {
    state_.pressure = filled_->pressures();
  }
  end_path();
  return result;
}

void SpringMotion::find_velocities(Step& step) {
  if (!integrator_.is_second_order()) {
    SheetMotion::find_velocities(step);
    return;
  }
  const auto timer = clock_.time("velocity");
  const double error = find_end(constrained_);
  if (options_.time.tolerance > 0) {
    step.error = max_over_ranks(sheet_.comm(), error) / size_;
  }
}

std::string SpringMotion::passed_limit() const {
  if (!options_.project.strain_limit) {
    return "";
  }
  const WeaveStrain strain =
      surface::weave_strain(sheet_, springs_->position(), state_.target_length, state_.burning->active);
  return strain.largest <= *options_.project.strain_limit ? "" : beyond_limit(strain, *options_.project.strain_limit);
}

void SpringMotion::report(Report& report, const Step& step) const {
  SheetMotion::report(report, step);
  report.add("elastic_energy", "J", springs_->elastic_energy(state_.position));
  if (path_) {
    report.add("load_time", "s", *state_.load_time);
  }
}

ElasticMotion::ElasticMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock,
                             Textures& textures, GasStage* gas)
    : SpringMotion(sheet, options, state, clock, gas,
                   stiffness_of_contact(sheet, options, stiffness_of(options.material).tensile[0])) {
  SheetMaterial material = options.material;
  material.damping = is_static() ? 0 : material.damping;
  const auto factors = [&](const char* key, const std::string& file) {
    return textures.values(sheet.uv, key, file, material.stiffness_range);
  };
  auto springs =
      std::make_unique<ElasticSheet>(sheet, material, options.sheet.thickness,
                                     MaterialFactors{factors("sheet.tensile_texture", material.tensile_texture),
                                                     factors("sheet.shear_texture", material.shear_texture),
                                                     factors("sheet.bending_texture", material.bending_texture)},
                                     pins_.pinned(), pins_.clamped(), elastic_options(options), others());
  largest_excess_ = springs->largest_excess();
  set_springs(std::move(springs));
}

StageResult ElasticMotion::begin_balance(Step& step) {
  if (step.has_burnt) {
    set_lengths();  // They follow from what is left, too.
  }
  return SpringMotion::begin_balance(step);
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
  constexpr double worth_a_word = 1.05;
  if (largest_excess_ > worth_a_word) {
    lines.push_back(
        fmt::format("some cells are so long that the sheet is {:.2g} times as stiff along them as asked for; expected "
                    "sides that differ by 1.7 at most",
                    largest_excess_));
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
