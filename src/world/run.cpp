#include "world/run.h"

#include <utility>

#include "base/error.h"
#include "base/stage_clock.h"
#include "io/console.h"
#include "meshing/mesh_check.h"
#include "meshing/triangulation.h"
#include "surface/shell.h"
#include "world/burn_run.h"
#include "world/inflate_run.h"
#include "world/load_mesh.h"
#include "world/mesh_only.h"
#include "world/step_control.h"

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

/// Steps a chain from its first frame to the end of the run. What the mesh is like is told when the input is known to
/// be good: bad input is refused by one line.
/// @param figures lines for somebody who watches
void run_chain(Chain& chain, const Options& options, const RunRecord& record, const std::vector<std::string>& figures,
               Console& console, StageClock& clock) {
  chain.draw();  // The first frame makes the folder, or refuses the chosen fields before anything is written.
  chain.record(0, 0);
  for (const std::string& line : record.mesh) {
    console.tell(line);
  }
  for (const std::string& line : figures) {
    console.say(line);
  }
  run_steps(chain, options.time, console, clock);
  console.stage_table(clock);
  console.tell("done: time " + time_text(chain.time()) + ", " + std::to_string(chain.step()) + " steps in " +
               duration_text(clock.elapsed()) + "; " + options.output.directory + "/" + options.output.name + ".pvd");
}

}  // namespace

void run(MPI_Comm comm, const Options& options, RunRecord record) {
  Console console(comm, options.output.monitor);
  console.say(record.program + " " + record.revision);
  if (options.mesh_only) {
    mesh_only(comm, options, std::move(record));
    return;
  }
  OutputFolder folder(comm, options.output, record);
  CheckedMesh checked = load_mesh(comm, options.mesh);
  SurfaceMesh& mesh = checked.mesh;
  on_root(comm, [&] { require_fit(checked, options); });
  record.mesh = mesh_lines(checked.report, options.chain);
  std::vector<std::string> figures{checked.report.quality()};
  if (options.chain == ChainKind::burn) {
    Sheet sheet = make_sheet(comm, mesh, options.sheet);
    figures.insert(figures.end(), {spring_line(sheet), partition_line(sheet)});
    StageClock clock(Burn::stage_names());
    BurnRun chain(std::move(sheet), options, folder, console, clock);
    run_chain(chain, options, record, figures, console, clock);
  } else {
    on_root(comm, [&] { mesh = triangulated(mesh); });
    const Membrane membrane = make_membrane(comm, mesh, options.sheet);
    figures.push_back(partition_line(membrane));
    StageClock clock(Inflate::stage_names());
    InflateRun chain(membrane, options, folder, clock);
    run_chain(chain, options, record, figures, console, clock);
  }
}

}  // namespace pellicle
