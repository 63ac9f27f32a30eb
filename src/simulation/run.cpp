#include "simulation/run.h"

#include <utility>

#include "base/error.h"
#include "base/stage_clock.h"
#include "io/console.h"
#include "mesh/mesh_check.h"
#include "mesh/shell.h"
#include "mesh/triangulation.h"
#include "simulation/burn_run.h"
#include "simulation/inflate_run.h"
#include "simulation/load_mesh.h"
#include "simulation/mesh_only.h"
#include "simulation/step_control.h"

namespace pellicle {

namespace {

/// The springs of each colour.
std::string spring_line(const Sheet& sheet) {
  std::string line = "springs:";
  for (const Colour colour : all_colours) {
    line += std::string(" ") + colour_names[static_cast<std::size_t>(colour)] + " " +
            std::to_string(sheet.of(colour).layout.global);
  }
  return line;
}

/// Steps a chain from its first frame to the end of the run.
void run_chain(Chain& chain, MPI_Comm comm, const Options& options, const RunRecord& record, Console& console,
               StageClock& clock) {
  chain.draw();  // The first frame makes the folder, or refuses the chosen fields before anything is written.
  write_run_record(comm, options.output.directory, record);
  chain.record(0, 0);
  run_steps(chain, options.time, console, clock);
  console.stage_table(clock);
}

}  // namespace

void run(MPI_Comm comm, const Options& options, const RunRecord& record) {
  Console console(comm, options.output.monitor);
  console.say(record.program + " " + record.revision);
  if (options.mesh_only) {
    mesh_only(comm, options);
    return;
  }
  SurfaceMesh mesh = load_mesh(comm, options.mesh, console);
  if (options.chain == "burn") {
    on_root(comm, [&] { require_quads(mesh, options.mesh.name()); });
    Sheet sheet = make_sheet(comm, mesh, options.sheet);
    console.say(spring_line(sheet));
    console.say(partition_line(sheet));
    StageClock clock(Burn::stage_names());
    BurnRun chain(std::move(sheet), options, console, clock);
    run_chain(chain, comm, options, record, console, clock);
  } else {
    on_root(comm, [&] { mesh = triangulated(mesh); });
    const Membrane membrane = make_membrane(comm, mesh, options.sheet);
    console.say(partition_line(membrane));
    StageClock clock(Inflate::stage_names());
    InflateRun chain(membrane, options, clock);
    run_chain(chain, comm, options, record, console, clock);
  }
}

}  // namespace pellicle
