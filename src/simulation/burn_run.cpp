#include "simulation/burn_run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ablation/cut_surface.h"
#include "base/error.h"
#include "base/units.h"

namespace pellicle {

namespace {

/// Derived fields that frames show beside the state's.
struct FrameFields {
  std::vector<double> mass_ratio;     ///< m/m^init of the local particles
  std::vector<double> strain;         ///< rms over the springs of a particle
  std::vector<double> spring_strain;  ///< of the owned springs, colour after colour
  std::vector<double> target_length;  ///< likewise [m]
};

FrameFields derive(const Sheet& sheet, const State& state) {
  FrameFields fields;
  const auto particles = static_cast<std::size_t>(sheet.particles.local());
  fields.mass_ratio.resize(particles);
  for (std::size_t i = 0; i < particles; ++i) {
    fields.mass_ratio[i] = state.mass.data()[i] / sheet.initial_mass[i];
  }
  Field sum(sheet.particles, 2);  // of squared strains, and how many
  for (const Colour colour : all_colours) {
    const std::vector<double> strain = strains(sheet.of(colour), state, colour);
    const auto& target_length = state.target_length[static_cast<std::size_t>(colour)];
    const PetscInt owned = sheet.of(colour).owned();
    fields.spring_strain.insert(fields.spring_strain.end(), strain.begin(), strain.begin() + owned);
    fields.target_length.insert(fields.target_length.end(), target_length.begin(), target_length.begin() + owned);
    for (PetscInt s = 0; s < sheet.of(colour).owned(); ++s) {
      const double value = strain[static_cast<std::size_t>(s)];
      for (const PetscInt end : sheet.of(colour).ends[static_cast<std::size_t>(s)]) {
        sum.values().col(end) += Eigen::Vector2d(value * value, 1);
      }
    }
  }
  sum.add_ghosts();
  sum.update_ghosts();
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    fields.strain.push_back(std::sqrt(sum.values()(0, i) / std::max(1.0, sum.values()(1, i))));
  }
  return fields;
}

/// Prints the curves of Fig. 8 for one time step.
void print_errors(MPI_Comm comm, const std::vector<ProjectionError>& errors) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  for (const ProjectionError& error : errors) {
    if (rank == 0) {
      const char* after = error.projected ? colour_names[static_cast<std::size_t>(*error.projected)] : "start";
      std::printf("  projection step %d %-6s ||C|| red %.4e green %.4e blue %.4e yellow %.4e all %.4e\n", error.step,
                  after, error.colour[0], error.colour[1], error.colour[2], error.colour[3], error.total);
    }
  }
}

}  // namespace

BurnRun::BurnRun(const Sheet& sheet, const Options& options, StageClock& clock)
    : sheet_(sheet),
      options_(options),
      clock_(clock),
      burn_(sheet, options, clock),
      state_(burn_.initial_state()),
      writer_(sheet.comm(), options.output) {
  if (options.time.tolerance > 0) {
    throw Error("time.tolerance: " + number_text(options.time.tolerance) +
                ": the burning chain does not estimate the error of its steps; expected 0");
  }
}

StepResult BurnRun::advance(double h) {
  last_ = burn_.advance(state_, h);
  StepResult result;
  result.converged = last_.converged;
  result.reason = last_.reason;
  result.iterations = last_.heat_iterations + last_.dynamics_iterations;
  char figures[40];
  std::snprintf(figures, sizeof figures, "|C| %.3e m", last_.constraint_error);
  result.figures = figures;
  return result;
}

void BurnRun::draw() {
  const auto timer = clock_.time("output");
  const FrameFields fields = derive(sheet_, state_);
  const Living living(sheet_);
  const Drawing surface = drawing_of(sheet_, cut_surface(sheet_, living, fields.mass_ratio));
  std::optional<Drawing> springs;
  if (options_.output.springs) {
    springs = drawing_of_springs(sheet_, living);
  }
  Frame frame;
  frame.surface = &surface;
  frame.springs = springs ? &*springs : nullptr;
  frame.time = state_.time;
  frame.step = state_.step;
  frame.positions = state_.position.data();
  frame.particle_fields = {{"temperature", 1, state_.temperature.data()},
                           {"mass_ratio", 1, fields.mass_ratio.data()},
                           {"velocity", 3, state_.velocity.data()},
                           {"strain", 1, fields.strain.data()}};
  frame.spring_fields = {{"strain", 1, fields.spring_strain.data()}, {"target_length", 1, fields.target_length.data()}};
  writer_.write(frame);
}

void BurnRun::record(double h, int retries) {
  if (ledger_ == nullptr) {
    ledger_ = std::make_unique<Ledger>(sheet_, options_, clock_);
  }
  if (options_.project.monitor && state_.step > 0) {
    print_errors(sheet_.comm(), burn_.projection_errors());
    ledger_->add(state_.time, state_.step, burn_.projection_errors());
  }
  ledger_->add(state_, last_, h, retries);
}

}  // namespace pellicle
