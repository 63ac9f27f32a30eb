#include "world/run.h"

#include <filesystem>
#include <memory>
#include <utility>

#include "base/error.h"
#include "base/stage_clock.h"
#include "base/units.h"
#include "io/console.h"
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

/// A word as a shell reads it back.
std::string shell_word(const std::string& word) {
  if (word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=.,:/@%^") ==
          std::string::npos &&
      !word.empty()) {
    return word;
  }
  std::string text = "'";
  for (const char letter : word) {
    text += letter == '\'' ? "'\\''" : std::string(1, letter);
  }
  return text + "'";
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

  /// The whole run. Collective.
  void run() {
    StageClock clock(stage_names());
    const Begun begun = open_checkpoint() ? from_checkpoint(*checkpoint_, options_, folder_, clock) : from_mesh(clock);
    const bool goes_on = goes_on_in_its_folder();
    Checkpoints checkpoints(folder_, options_.checkpoint, record_, goes_on ? begun.chain->step() : -1);
    begin_output(begun, goes_on);
    if (options_.verify_restart > 0) {
      verify(*begun.chain, clock, checkpoints);
    } else {
      steps(*begun.chain, clock, checkpoints);
    }
  }

 private:
  const std::vector<std::string>& stage_names() const {
    return options_.chain == ChainKind::burn ? Burn::stage_names() : Inflate::stage_names();
  }

  /// A chain before its first step here, and lines about it for somebody who watches.
  struct Begun {
    std::unique_ptr<Chain> chain;
    std::vector<std::string> figures;
  };

  Begun from_mesh(StageClock& clock) {
    LoadedMesh loaded = load_mesh(comm_, options_);
    record_.mesh = loaded.lines;
    std::vector<std::string>& figures = loaded.figures;
    if (options_.chain == ChainKind::burn) {
      Sheet sheet = make_sheet(comm_, std::move(loaded.rows), options_.sheet);
      figures.insert(figures.end(), {spring_line(sheet), partition_line(sheet)});
      return {std::make_unique<BurnRun>(std::move(sheet), options_, folder_, console_, clock), figures};
    }
    Membrane membrane = make_membrane(comm_, std::move(loaded.rows), options_.sheet).membrane;
    figures.push_back(partition_line(membrane));
    return {std::make_unique<InflateRun>(std::move(membrane), options_, folder_, clock), figures};
  }

  Begun from_checkpoint(const Hdf5File& checkpoint, const Options& options, OutputFolder& folder, StageClock& clock) {
    if (options.chain == ChainKind::burn) {
      auto chain = std::make_unique<BurnRun>(checkpoint, options, folder, console_, clock);
      const std::vector<std::string> figures{spring_line(chain->sheet()), partition_line(chain->sheet())};
      return {std::move(chain), figures};
    }
    auto chain = std::make_unique<InflateRun>(checkpoint, options, folder, clock);
    const std::vector<std::string> figures{partition_line(chain->membrane())};
    return {std::move(chain), figures};
  }

  /// Whether the run goes on from a checkpoint.
  bool open_checkpoint() {
    if (options_.restart.empty()) {
      return false;
    }
    checkpoint_ = pellicle::open_checkpoint(comm_, options_.restart, console_);
    require_same_options(table_, checkpoint_->read_text("options"), record_.options);
    record_.mesh = checkpoint_->read_lines("mesh");
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

  /// The first frame and row, or the continuation of those of the run before. What the mesh is like is told when the
  /// input is known to be good: bad input is refused by one line.
  void begin_output(const Begun& begun, bool goes_on) {
    Chain& chain = *begun.chain;
    if (goes_on) {
      keep_tables(folder_, *checkpoint_);
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
    for (const std::string& line : begun.figures) {
      console_.say(line);
    }
  }

  void steps(Chain& chain, StageClock& clock, Checkpoints& checkpoints) {
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

  /// Whether steps from a checkpoint are those of the run that goes on without it. @throws Error if they are not
  void verify(Chain& chain, StageClock& clock, Checkpoints& checkpoints) {
    TimeOptions time = options_.time;
    time.max_steps = chain.step() + options_.verify_restart;
    run_steps(chain, time, console_, clock, &checkpoints);
    chain.forget();
    const int middle = chain.step();
    time.max_steps = middle + options_.verify_restart;
    run_steps(chain, time, console_, clock);

    Options options = options_;
    options.output.directory += "/verify_restart";
    OutputFolder folder(comm_, options.output, record_);
    StageClock clock_again(stage_names());
    const std::unique_ptr<Hdf5File> checkpoint = pellicle::open_checkpoint(comm_, checkpoints.newest(), console_);
    const Begun again = from_checkpoint(*checkpoint, options, folder, clock_again);
    again.chain->draw();
    again.chain->record(0, 0);
    run_steps(*again.chain, time, console_, clock_again);

    std::string faults;
    const auto fields = differences(chain.state(), again.chain->state());
    for (const auto& [name, here] : fields) {
      double difference = here;
      MPI_Allreduce(MPI_IN_PLACE, &difference, 1, MPI_DOUBLE, MPI_MAX, comm_);
      if (difference > 0) {
        faults += (faults.empty() ? "" : ", ") + name + " by " + number_text(difference) + " of its largest";
      }
    }
    const std::string what = "verify_restart: steps " + std::to_string(middle + 1) + " to " +
                             std::to_string(chain.step()) + " straight and from " + checkpoints.newest();
    if (!faults.empty()) {
      throw Error(what + " differ: " + faults);
    }
    console_.tell(what + ": all " + std::to_string(fields.size()) + " fields are the same");
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
        command += shell_word(record_.arguments[k]) + " ";
      }
    }
    console_.tell("checkpoint: " + checkpoints.newest() + "; to go on: " + command + "-restart " +
                  shell_word(options_.output.directory));
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
  Run(comm, options, record, table, console).run();
}

}  // namespace pellicle
