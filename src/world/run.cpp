#include "world/run.h"

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "base/stage_clock.h"
#include "io/console.h"
#include "state/mesh_tables.h"
#include "surface/membrane.h"
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

/// The lines of a text.
std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line);
  }
  return lines;
}

/// A run: what its chains and its output have in common.
class Run {
 public:
  Run(MPI_Comm comm, const Options& options, RunRecord& record, const OptionTable& table, Console& console)
      : comm_(comm),
        options_(options),
        record_(record),
        table_(table),
        console_(console),
        folder_(comm, options.output, record) {}

  void burn() {
    StageClock clock(Burn::stage_names());
    if (open_checkpoint()) {
      BurnRun chain(*checkpoint_, options_, folder_, console_, clock);
      steps(chain, {spring_line(chain.sheet()), partition_line(chain.sheet())}, clock);
      return;
    }
    LoadedMesh loaded = load();
    BurnRun chain(make_sheet(comm_, std::move(loaded.rows), options_.sheet), options_, folder_, console_, clock);
    loaded.figures.insert(loaded.figures.end(), {spring_line(chain.sheet()), partition_line(chain.sheet())});
    steps(chain, loaded.figures, clock);
  }

  void inflate() {
    StageClock clock(Inflate::stage_names());
    if (open_checkpoint()) {
      const Membrane membrane =
          make_membrane(comm_, read_mesh(*checkpoint_, "objects/balloon/mesh"), options_.sheet).membrane;
      InflateRun chain(*checkpoint_, membrane, options_, folder_, clock);
      steps(chain, {partition_line(membrane)}, clock);
      return;
    }
    LoadedMesh loaded = load();
    const Membrane membrane = make_membrane(comm_, std::move(loaded.rows), options_.sheet).membrane;
    InflateRun chain(membrane, options_, folder_, clock);
    loaded.figures.push_back(partition_line(membrane));
    steps(chain, loaded.figures, clock);
  }

 private:
  LoadedMesh load() {
    LoadedMesh loaded = load_mesh(comm_, options_);
    record_.mesh = loaded.lines;
    return loaded;
  }

  /// Whether the run goes on from a checkpoint.
  bool open_checkpoint() {
    if (options_.restart.empty()) {
      return false;
    }
    checkpoint_ = pellicle::open_checkpoint(comm_, options_.restart, console_);
    require_same_options(table_, checkpoint_->read_text("options"), record_.options);
    record_.mesh = lines_of(checkpoint_->read_text("mesh"));
    return true;
  }

  /// Whether it goes on in the folder of the run that wrote the checkpoint.
  bool goes_on_in_its_folder() const {
    bool is_same = false;
    on_root(comm_, [&] {
      std::error_code none;
      is_same = checkpoint_ != nullptr &&
                std::filesystem::equivalent(std::filesystem::path(checkpoint_->path()).parent_path(),
                                            options_.output.directory, none);
    });
    MPI_Bcast(&is_same, 1, MPI_CXX_BOOL, 0, comm_);
    return is_same;
  }

  /// Steps a chain from its first frame, or from where it goes on, to the end of the run. What the mesh is like is told
  /// when the input is known to be good: bad input is refused by one line.
  /// @param figures lines for somebody who watches
  void steps(Chain& chain, const std::vector<std::string>& figures, StageClock& clock) {
    const bool goes_on = goes_on_in_its_folder();
    Checkpoints checkpoints(folder_, options_.checkpoint, record_, goes_on ? chain.step() : -1);
    if (goes_on) {
      folder_.keep([tables = checkpoint_->names("output/tables")](const std::string& file) {
        return std::find(tables.begin(), tables.end(), file) != tables.end();
      });
      chain.resume_output(*checkpoint_);
    } else {
      chain.draw();  // The first frame makes the folder, or refuses the chosen fields before anything is written.
      chain.record(0, 0);
    }
    for (const std::string& line : record_.mesh) {
      console_.tell(line);
    }
    if (checkpoint_ != nullptr) {
      console_.tell("goes on from " + checkpoint_->path() + ": time " + time_text(chain.time()) + ", step " +
                    std::to_string(chain.step()));
      checkpoint_ = nullptr;
    }
    for (const std::string& line : figures) {
      console_.say(line);
    }
    try {
      run_steps(chain, options_.time, console_, clock, &checkpoints);
    } catch (const Error&) {
      tell_of(checkpoints);
      throw;
    }
    console_.stage_table(clock);
    console_.tell("done: time " + time_text(chain.time()) + ", " + std::to_string(chain.step()) + " steps in " +
                  duration_text(clock.elapsed()) + "; " + options_.output.directory + "/" + options_.output.name +
                  ".pvd");
    tell_of(checkpoints);
  }

  /// How to go on from the newest checkpoint, if there is one.
  void tell_of(const Checkpoints& checkpoints) const {
    if (checkpoints.newest().empty()) {
      return;
    }
    std::string command;
    for (std::size_t k = 0; k < record_.arguments.size(); ++k) {
      if (record_.arguments[k] == "-restart") {
        ++k;
      } else {
        command += record_.arguments[k] + " ";
      }
    }
    console_.tell("checkpoint: " + checkpoints.newest() + "; to go on: " + command + "-restart " +
                  options_.output.directory);
  }

  MPI_Comm comm_;
  const Options& options_;
  RunRecord& record_;
  const OptionTable& table_;
  Console& console_;
  OutputFolder folder_;
  std::unique_ptr<Hdf5File> checkpoint_;  ///< from which the run goes on
};

}  // namespace

void run(MPI_Comm comm, const Options& options, RunRecord record, const OptionTable& table) {
  Console console(comm, options.output.monitor);
  console.say(record.program + " " + record.revision);
  if (options.mesh_only) {
    mesh_only(comm, options, std::move(record));
    return;
  }
  Run run(comm, options, record, table, console);
  options.chain == ChainKind::burn ? run.burn() : run.inflate();
}

}  // namespace pellicle
