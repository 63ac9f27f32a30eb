#include "world/inflate_run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "prism/wall_stress.h"
#include "state/field_tables.h"
#include "state/mesh_tables.h"
#include "surface/membrane_geometry.h"
#include "world/non_finite.h"

namespace pellicle {

namespace {

// Of a checkpoint, in the group of the object.
std::string balloon_mesh(const ObjectOutput& output) { return output.group("balloon") + "/mesh"; }
std::string balloon_state(const ObjectOutput& output) { return output.group("balloon") + "/state"; }

}  // namespace

InflateRun::InflateRun(Membrane membrane, const Options& options, const ObjectOutput& output)
    : membrane_(std::make_unique<Membrane>(std::move(membrane))),
      output_(output),
      inflate_(*membrane_, options, output.clock),
      state_(inflate_.initial_state()),
      kept_(*membrane_, inflate_.chambers().count()),
      surface_(drawing_of(*membrane_)) {}

InflateRun::InflateRun(const Hdf5File& checkpoint, const Options& options, const ObjectOutput& output)
    : InflateRun(make_membrane(checkpoint.comm(), read_mesh(checkpoint, balloon_mesh(output)), options.sheet).membrane,
                 options, output) {
  read_fields(checkpoint, balloon_state(output), state_, membrane_->persistent_id, membrane_->element_id);
}

StepResult InflateRun::advance(double h) {
  last_ = inflate_.advance(state_, h);
  StepResult result;
  result.converged = last_.converged;
  result.reason = last_.reason;
  if (result.converged) {
    const auto vertices = static_cast<std::size_t>(membrane_->particles.local());
    result.reason = non_finite(
        membrane_->comm(), {{"position", state_.position.data(), 3 * vertices},
                            {"velocity", state_.velocity.data(), 3 * vertices},
                            {"thickness", state_.thickness_ratio.data(), state_.thickness_ratio.size()},
                            {"pressure", state_.pressure.data(), static_cast<std::size_t>(state_.pressure.size())}});
    result.converged = result.reason.empty();
  }
  result.iterations = last_.linear_iterations;
  result.step_error = last_.step_error;
  if (state_.pressure.size() > 0) {
    char figures[40];
    std::snprintf(figures, sizeof figures, "p %.4g Pa", state_.pressure[0]);
    result.figures = figures;
  }
  return result;
}

void InflateRun::keep() { kept_ = state_; }

void InflateRun::restore() { state_ = kept_; }

void InflateRun::draw(const FrameSink& write) {
  const auto timer = output_.clock.time("output");
  const Wall& wall = inflate_.elements().wall();
  const std::size_t elements = membrane_->triangles.size();
  std::vector<double> thickness(elements);
  std::vector<double> stretch(2 * elements);
  std::vector<double> stress(2 * elements);
  for (std::size_t e = 0; e < elements; ++e) {
    const auto [e12, e13] = edges_of(state_.position.data(), membrane_->triangles[e]);
    thickness[e] = wall.thickness[e] * state_.thickness_ratio[e];
    const PrincipalState principal =
        principal_state(wall.material_of(e), wall.rule, wall.rest[e], e12, e13, state_.thickness_ratio[e]);
    Eigen::Map<Eigen::Vector2d>(stretch.data() + 2 * e) = principal.stretch;
    Eigen::Map<Eigen::Vector2d>(stress.data() + 2 * e) = principal.stress;
  }
  Frame frame;
  frame.time = state_.time;
  frame.step = state_.step;
  frame.surface = &surface_;
  frame.positions = state_.position.data();
  frame.particle_fields = drawn_fields(state_, Item::particle);
  frame.cell_fields = drawn_fields(state_, Item::cell);
  frame.cell_fields.insert(
      frame.cell_fields.end(),
      {{"thickness", 1, thickness.data()}, {"stretch", 2, stretch.data()}, {"stress", 2, stress.data()}});
  write(frame);
}

void InflateRun::save(Hdf5File& checkpoint) const {
  const std::vector<PetscInt>& particles = membrane_->persistent_id;
  const std::vector<PetscInt>& elements = membrane_->element_id;
  write_mesh(checkpoint, balloon_mesh(output_), rows_of(*membrane_, {}, {}));
  write_fields(checkpoint, balloon_state(output_), state_,
               {particles.begin(), particles.begin() + membrane_->particles.owned},
               {elements.begin(), elements.begin() + membrane_->elements.owned});
  ledger_->save(checkpoint);
}

void InflateRun::resume_output(const Hdf5File& checkpoint) {
  ledger_ = std::make_unique<BalloonLedger>(output_, inflate_, &checkpoint);
  ledger_->go_on_from(state_);
}

void InflateRun::record(double h, int retries) {
  if (ledger_ == nullptr) {
    ledger_ = std::make_unique<BalloonLedger>(output_, inflate_);
  }
  ledger_->add(state_, last_, h, retries);
}

}  // namespace pellicle
