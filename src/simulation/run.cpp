#include "simulation/run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/error.h"
#include "base/stage_clock.h"
#include "io/console.h"
#include "io/frame_writer.h"
#include "mesh/mesh_check.h"
#include "mesh/shell.h"
#include "simulation/burn.h"
#include "simulation/ledger.h"

namespace pellicle {

namespace {

/// Mesh, checked on rank 0, as a distributed shell. Collective.
Sheet load_sheet(MPI_Comm comm, const Options& options, Console& console) {
  SurfaceMesh mesh;
  MeshReport report;
  on_root(comm, [&] {
    mesh = make_mesh(options.mesh);
    report = check_and_repair(mesh, options.mesh.name());
    require_quads(mesh, options.mesh.name());
  });
  for (const std::string& line : report.lines()) {
    console.say(line);
  }
  return make_sheet(comm, mesh, options.sheet);
}

std::string header_of(const Sheet& sheet) {
  int ranks = 1;
  MPI_Comm_size(sheet.comm(), &ranks);
  std::string line = "springs:";
  for (const Colour colour : all_colours) {
    line += std::string(" ") + colour_names[static_cast<std::size_t>(colour)] + " " +
            std::to_string(sheet.of(colour).layout.global);
  }
  char text[160];
  std::snprintf(text, sizeof text, "\nranks: %d; partition: edge cut %d, imbalance %.3f", ranks,
                static_cast<int>(sheet.partition.edge_cut), sheet.partition.imbalance);
  return line + text;
}

/// Derived fields that frames show beside the state's.
struct FrameFields {
  std::vector<double> mass_ratio;             ///< m/m^init of the local particles
  std::vector<double> strain;                 ///< rms over the springs of a particle
  std::array<std::vector<double>, 4> spring;  ///< strain of the local springs
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
    auto& strain = fields.spring[static_cast<std::size_t>(colour)];
    strain = strains(sheet.of(colour), state, colour);
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

void write_frame(FrameWriter& writer, const Sheet& sheet, const State& state) {
  const FrameFields fields = derive(sheet, state);
  Frame frame;
  frame.time = state.time;
  frame.step = state.step;
  frame.positions = state.position.data();
  frame.particle_fields = {{"temperature", 1, state.temperature.data()},
                           {"mass_ratio", 1, fields.mass_ratio.data()},
                           {"velocity", 3, state.velocity.data()},
                           {"strain", 1, fields.strain.data()}};
  for (std::size_t colour = 0; colour < all_colours.size(); ++colour) {
    frame.spring_fields[colour] = {{"strain", 1, fields.spring[colour].data()},
                                   {"target_length", 1, state.target_length[colour].data()}};
  }
  writer.write(frame);
}

/// A time within rounding of a whole number of steps becomes that number of steps: sums of steps drift.
double without_drift(double time, double step) {
  const double whole = std::round(time / step) * step;
  return std::abs(time - whole) < 1e-9 * step ? whole : time;
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

void run(MPI_Comm comm, const Options& options, const RunRecord& record) {
  Console console(comm, options.output.monitor);
  console.say(record.program + " " + record.revision);
  const Sheet sheet = load_sheet(comm, options, console);
  console.say(header_of(sheet));
  StageClock clock(Burn::stage_names());
  Burn burn(sheet, options, clock);
  State state = burn.initial_state();
  FrameWriter writer(sheet, options.output);

  const auto draw = [&] {
    const auto timer = clock.time("output");
    write_frame(writer, sheet, state);
  };
  draw();
  write_run_record(comm, options.output.directory, record);
  Ledger ledger(sheet, options, clock);
  ledger.add(state, {}, 0, 0);

  const TimeOptions& time = options.time;
  const auto is_last = [&] {
    return state.time >= time.end - 1e-9 * time.step || (time.max_steps > 0 && state.step >= time.max_steps);
  };
  double h = time.step;
  int last_drawn = 0;
  while (!is_last()) {
    clock.start_lap();
    const Snapshot before(state);
    h = std::min(h, time.end - state.time);
    int retries = 0;
    BurnStep step = burn.advance(state, h);
    while (!step.converged && retries < time.max_retries) {
      before.restore(state);
      h /= 2;
      ++retries;
      step = burn.advance(state, h);
    }
    if (!step.converged) {
      before.restore(state);
      if (last_drawn != state.step) {
        draw();
      }
      throw Error("step " + std::to_string(state.step + 1) + " at time " + std::to_string(state.time) +
                  " s failed, also with its length halved " + std::to_string(retries) + " times: " + step.reason +
                  "; the state before it is the last frame");
    }
    state.time = without_drift(state.time, time.step);
    if (options.project.monitor) {
      print_errors(comm, burn.projection_errors());
      ledger.add(state.time, state.step, burn.projection_errors());
    }
    if (is_last() || writer.due(state.time, state.step)) {
      draw();
      last_drawn = state.step;
    }
    ledger.add(state, step, h, retries);
    const double share =
        std::max(state.time / time.end, time.max_steps > 0 ? state.step / double(time.max_steps) : 0.0);
    console.progress({state.step, state.time, std::min(1.0, share), step.heat_iterations + step.dynamics_iterations,
                      step.constraint_error});
    h = std::min(2 * h, time.step);
  }
  console.stage_table(clock);
}

}  // namespace pellicle
