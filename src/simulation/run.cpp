#include "simulation/run.h"

#include <cstdio>

#include "base/error.h"
#include "base/stage_clock.h"
#include "io/console.h"
#include "mesh/mesh_check.h"
#include "mesh/shell.h"
#include "simulation/burn_run.h"
#include "simulation/step_control.h"

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

}  // namespace

void run(MPI_Comm comm, const Options& options, const RunRecord& record) {
  Console console(comm, options.output.monitor);
  console.say(record.program + " " + record.revision);
  const Sheet sheet = load_sheet(comm, options, console);
  console.say(header_of(sheet));
  StageClock clock(Burn::stage_names());
  BurnRun chain(sheet, options, clock);
  chain.draw();  // The first frame makes the folder, or refuses the chosen fields before anything is written.
  write_run_record(comm, options.output.directory, record);
  chain.record(0, 0);
  run_steps(chain, options.time, console, clock);
  console.stage_table(clock);
}

}  // namespace pellicle
