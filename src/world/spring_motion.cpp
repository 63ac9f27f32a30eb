#include "world/spring_motion.h"

#include <fmt/format.h>

#include <utility>

#include "combustion/combustion.h"
#include "elastic/elastic_sheet.h"
#include "solvers/vertex_potential.h"

namespace pellicle {
inline namespace world {

namespace {

/// Of a sheet without bodies.
const std::vector<Body> none;

/// Of contact, in steps of the deck's length, for a sheet of this tensile stiffness [N/m] [Pa/m].
double stiffness_of_contact(const Sheet& sheet, const Options& options, double tensile_stiffness) {
  constexpr double strain = 0.05;  // as much as a sheet may bear
  const bool is_static = options.time.scheme == TimeScheme::statics;
  return usual_contact_stiffness(sheet, strain * tensile_stiffness, is_static ? 0 : options.sheet.areal_density,
                                 options.time.step);
}

/// A line where a sheet has the layers of a thin material, but not its stiffness; empty: it has not.
std::string default_stiffness_remark(const Options& options) {
  constexpr double thin = 1e-3;     // [m]
  constexpr double of_paper = 3e9;  // [Pa]
  const SheetMaterial& material = options.material;
  if (material.young_modulus || material.tensile_stiffness || options.sheet.thickness > thin) {
    return "";
  }
  return fmt::format(
      "sheet.tensile_stiffness: {:.4g} N/m, the default, not that of a material {:.3g} m thick (sheet.thickness): "
      "such paper has some {:.1g} N/m; expected sheet.young_modulus with sheet.physical_thickness, or stiffnesses",
      stiffness_of(material).tensile[0], options.sheet.thickness, of_paper * options.sheet.thickness);
}

}  // namespace

SpringMotion::SpringMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas)
    : SpringMotion(sheet, options, state, clock, gas, stiffness_of_contact(sheet, options, options.spring.stiffness)) {
  SpringOptions spring = options.spring;
  spring.damping = is_static() ? 0 : spring.damping;
  set_springs(std::make_unique<SpringSheet>(sheet, spring, pins_.pinned(), options.time.step, others()));
}

SpringMotion::SpringMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas,
                           double contact_stiffness)
    : SheetMotion(sheet, options, state, clock, gas, contact_stiffness) {
  drag_is_balanced_ = true;
  if (air_) {
    drag_ = make_drag_potential(
        sheet.particles, *air_, start_, [this] { return h_ > 0 && !is_static() ? 1 / h_ : 0; },
        [this](PetscInt i) { return start_.vector(i); });
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
  if (gas_ != nullptr) {
    filled_.emplace(*springs_, gas_->chambers(), gas_->step(), start_, options_.gas.tangent);
    gas_->set_filled(*filled_);
  }
}

std::vector<Potential*> SpringMotion::others() const {
  std::vector<Potential*> potentials;
  for (Potential* potential : {static_cast<Potential*>(body_contact_.get()), drag_.get(), weight_.get()}) {
    if (potential != nullptr) {
      potentials.push_back(potential);
    }
  }
  return potentials;
}

void SpringMotion::follow() {
  SheetMotion::follow();
  start_.values() = state_.position.values();
  mass_.assign(mass(), mass() + sheet_.particles.local());
  set_stiffness_factors();
  springs_->set_shape(input(options_.time.step));
}

/// Char is softer, linearly in the share that has burnt.
void SpringMotion::set_stiffness_factors() {
  stiffness_factor_.assign(sheet_.particles.local(), 1);
  for (std::size_t i = 0; i < stiffness_factor_.size() && options_.combustion.char_stiffness != 1; ++i) {
    stiffness_factor_[i] +=
        (options_.combustion.char_stiffness - 1) * burnt_share(mass()[i] / sheet_.initial_mass[i], options_.combustion);
  }
}

SheetInput SpringMotion::input(double h) const {
  return {{is_static() ? holding_ : mass_, held_, start_, h},
          state_.target_length,
          volume_ratio_,
          stiffness_factor_,
          state_.burning->living};
}

StageResult SpringMotion::begin_balance(Step& step) {
  set_volume_ratios(volume_ratio_, sheet_, state_.burning->mass, options_.combustion);
  set_stiffness_factors();
  if (is_static()) {
    holding_.assign(mass_.size(), springs_->holding_stiffness() * h_ * h_);
  }
  const auto timer = clock_.time("projection");
  begin_bodies(step.h);
  springs_->begin(state_.position, input(step.h));
  if (filled_) {
    filled_->begin_step(state_.pressure, state_.time + step.h, step.h);
  }
  return {};
}

StageResult SpringMotion::find_positions(Step& step) {
  StageResult result = take_positions(*part(), step);
  if (filled_) {
    state_.pressure = filled_->pressures();
  }
  return result;
}

void SpringMotion::add_spring_forces(Eigen::Matrix3Xd& sum) {
  for (const Potential* potential : springs_->of_shape()) {
    sum += forces_of(*potential);
  }
}

std::string SpringMotion::passed_limit() const {
  if (!options_.project.strain_limit) {
    return "";
  }
  const NetStrain strain =
      surface::net_strain(sheet_, springs_->position(), state_.target_length, state_.burning->living);
  return strain.largest <= *options_.project.strain_limit ? "" : beyond_limit(strain, *options_.project.strain_limit);
}

const std::vector<Eigen::Matrix3d>& SpringMotion::stress() {
  return spring_stress_->find(state_.burning->living, springs_->spring_forces(state_.position), state_.position);
}

const std::vector<Body>& SpringMotion::bodies() const {
  return body_contact_ != nullptr ? body_contact_->bodies() : none;
}

void SpringMotion::report(Report& report, const Step& step) const {
  SheetMotion::report(report, step);
  report.add("elastic_energy", "J", springs_->elastic_energy(state_.position));
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
  ElasticOptions elastic = options.elastic;
  elastic.strain_limit = options.project.strain_limit;
  elastic.usual_h = options.time.step;
  set_springs(
      std::make_unique<ElasticSheet>(sheet, material, options.sheet.thickness,
                                     MaterialFactors{factors("sheet.tensile_texture", material.tensile_texture),
                                                     factors("sheet.shear_texture", material.shear_texture),
                                                     factors("sheet.bending_texture", material.bending_texture)},
                                     pins_.pinned(), pins_.clamped(), elastic, others()));
  largest_excess_ = springs_->largest_excess();
}

void ElasticMotion::set_lengths() {
  set_volume_ratios(volume_ratio_, sheet_, state_.burning->mass, options_.combustion);
  set_surface_lengths(state_.target_length, sheet_, state_.burning->living, volume_ratio_);
}

StageResult ElasticMotion::begin_balance(Step& step) {
  if (step.has_burnt) {
    set_lengths();  // They follow from what is left, too.
  }
  return SpringMotion::begin_balance(step);
}

NetStrain ElasticMotion::net_strain() const {
  return surface::net_strain(sheet_, state_.position, state_.target_length, state_.burning->living,
                             springs_->bearing_springs(state_.burning->living));
}

std::vector<std::string> ElasticMotion::first_remarks() const {
  std::vector<std::string> lines;
  if (const std::string line = default_stiffness_remark(options_); !line.empty()) {
    lines.push_back(line);
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

}  // namespace world
}  // namespace pellicle
