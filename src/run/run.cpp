#include "run/run.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

#include "base/error.h"
#include "base/stage_clock.h"
#include "base/units.h"
#include "io/console.h"
#include "linear/saved_system.h"
#include "parallel/collective.h"
#include "run/world_output.h"
#include "world/load_mesh.h"

namespace pellicle::run {

namespace {

/// A word in the form that a shell reads as the same word.
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

/// A run: it makes its world and its output, and steps the world.
class Run {
 public:
  /// @param table of the options of the run as a whole
  Run(MPI_Comm comm, const RunPlan& plan, const OptionTable& table, RunRecord& record, Console& console)
      : comm_(comm),
        plan_(plan),
        table_(table),
        options_(plan.objects.front().options),
        record_(record),
        console_(console),
        folder_(comm, options_.output, record) {
    keep_what_is_read();
  }

  /// The whole run. Collective.
  void run() {
    open_checkpoint();
    World world = make_world(checkpoint_.get());
    WorldOutput output = output_of(world, folder_);
    const bool goes_on = goes_on_in_its_folder();
    Checkpoints checkpoints(folder_, options_.checkpoint, record_, goes_on ? world.steps() : -1);
    begin_output(output, goes_on);
    if (options_.verify_restart > 0) {
      verify(output, checkpoints);
    } else {
      steps(output, checkpoints);
    }
  }

 private:
  /// Files that the run reads stay, though an earlier run has written them: the mesh of -mesh_only.
  void keep_what_is_read() {
    std::vector<std::string> files;
    for (const NamedOptions& object : plan_.objects) {
      files.push_back(object.options.mesh.file);
    }
    for (const InputFile& input : record_.inputs) {
      files.push_back(input.path);
    }
    folder_.keep([this, files](const std::string& name) {
      return std::any_of(files.begin(), files.end(), [&](const std::string& file) {
        std::error_code none;
        return std::filesystem::equivalent(folder_.path(name), file, none);
      });
    });
  }

  /// An object that begins with its mesh.
  std::unique_ptr<Object> object_from_mesh(const NamedOptions& object) {
    LoadedMesh loaded = load_mesh(comm_, object.options);
    add_lines(record_.mesh, object.name, loaded.lines);
    add_lines(figures_, object.name, loaded.figures);
    return std::make_unique<Object>(object.name, object.options, comm_, std::move(loaded.rows));
  }

  /// @param checkpoint null: the objects begin with their meshes
  World make_world(const Hdf5File* checkpoint) {
    std::vector<std::unique_ptr<Object>> objects;
    for (const NamedOptions& object : plan_.objects) {
      objects.push_back(about_object(object.name, [&] {
        return checkpoint == nullptr ? object_from_mesh(object)
                                     : std::make_unique<Object>(object.name, object.options, *checkpoint);
      }));
      add_lines(figures_, object.name, objects.back()->lines());
    }
    return {std::move(objects), plan_.groups};
  }

  /// The writer of a world's frames and tables into a folder.
  WorldOutput output_of(World& world, OutputFolder& folder) {
    return {world, folder, console_, options_.output, drawings_of_bodies(comm_, plan_.objects)};
  }

  /// The checkpoint from which the run goes on, if it does.
  void open_checkpoint() {
    if (!options_.restart.empty()) {
      checkpoint_ = pellicle::open_checkpoint(comm_, options_.restart, console_);
      require_same_run(table_, *checkpoint_, record_);
      if (record_.decks.empty()) {  // It goes on with the options that the run has kept.
        record_.decks = decks_of(*checkpoint_);
      }
      record_.mesh = checkpoint_->read_lines("mesh");
    }
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
    return on_any_rank(comm_, is_same);
  }

  /// The first frame and row, or the continuation of those of an earlier run. Lines about the mesh are printed only
  /// when the input is known to be good: bad input is refused by one line.
  void begin_output(WorldOutput& output, bool goes_on) {
    const World& world = output.world();
    if (goes_on) {
      keep_tables(folder_, *checkpoint_);
      output.resume(*checkpoint_);
    } else {
      output.begin();
    }
    console_.tell(record_.mesh);
    console_.tell(world.first_remarks());
    if (checkpoint_ != nullptr) {
      console_.tell("goes on from " + checkpoint_->path() + ": time " + time_text(world.time()) + ", step " +
                    std::to_string(world.steps()));
      checkpoint_ = nullptr;
    }
    for (const std::string& line : figures_) {
      console_.say(line);
    }
  }

  void steps(WorldOutput& output, Checkpoints& checkpoints) {
    try {
      run_steps(output, options_.time, console_, &checkpoints);
    } catch (const Error&) {
      tell_of(checkpoints);
      throw;
    }
    const World& world = output.world();
    const std::vector<std::pair<std::string, const StageClock*>> clocks = world.clocks();
    console_.stage_table(clocks);
    console_.tell("done: time " + time_text(world.time()) + ", " + std::to_string(world.steps()) + " steps in " +
                  duration_text(clocks.front().second->elapsed()) + "; " + options_.output.directory + "/" +
                  options_.output.name + ".pvd");
    tell_of(checkpoints, &world);
  }

  /// Whether steps from a checkpoint equal those of the run that continues without it. @throws Error if they do not
  void verify(WorldOutput& output, Checkpoints& checkpoints) {
    const World& world = output.world();
    TimeOptions time = options_.time;
    time.max_steps = world.steps() + options_.verify_restart;
    run_steps(output, time, console_, &checkpoints);
    const int middle = world.steps();
    time.max_steps = middle + options_.verify_restart;
    run_steps(output, time, console_);
    if (world.steps() == middle) {
      throw Error("verify_restart: nothing is compared, since the run ends with step " + std::to_string(middle) +
                  " at " + time_text(world.time()) +
                  ", where it would go on from a checkpoint; expected a later end, such as by time.end");
    }

    OutputOptions elsewhere = options_.output;
    elsewhere.directory += "/verify_restart";
    OutputFolder folder(comm_, elsewhere, record_);
    const std::unique_ptr<Hdf5File> checkpoint = pellicle::open_checkpoint(comm_, checkpoints.newest(), console_);
    World again = make_world(checkpoint.get());
    WorldOutput output_again = output_of(again, folder);
    output_again.begin();
    run_steps(output_again, time, console_);

    std::string faults;
    std::size_t compared = 0;
    for (std::size_t i = 0; i < world.objects().size(); ++i) {
      const Object& object = *world.objects()[i];
      for (const auto& [name, difference] : differences(comm_, object.state(), again.objects()[i]->state())) {
        ++compared;
        if (difference > 0) {
          faults += (faults.empty() ? "" : ", ") + (object.name().empty() ? "" : object.name() + "'s ") + name +
                    " by " + number_text(difference) + " of its largest";
        }
      }
    }
    const std::string what = "verify_restart: steps " + std::to_string(middle + 1) + " to " +
                             std::to_string(world.steps()) + (world.steps() < time.max_steps ? ", the last," : "") +
                             " straight and from " + checkpoints.newest();
    if (!faults.empty()) {
      throw Error(what + " differ: " + faults);
    }
    console_.tell(what + ": all " + std::to_string(compared) + " fields are the same");
  }

  /// The newest checkpoint, if there is one, and how to go on from it.
  /// @param ended the world, if the run has reached its end: it goes on beyond it, unless its objects cannot
  void tell_of(const Checkpoints& checkpoints, const World* ended = nullptr) const {
    if (checkpoints.newest().empty()) {
      return;
    }
    std::string words = "checkpoint: " + checkpoints.newest();
    if (ended == nullptr || ended->ended().empty()) {
      words +=
          "; to go on: " + shell_word(record_.arguments.front()) + " -restart " + shell_word(options_.output.directory);
    }
    if (ended != nullptr && ended->ended().empty()) {
      const bool by_steps = options_.time.max_steps > 0 && ended->steps() >= options_.time.max_steps;
      words += by_steps ? " -time_max_steps 0" : " -time_end LATER";
    }
    console_.tell(words);
  }

  MPI_Comm comm_;
  const RunPlan& plan_;
  const OptionTable& table_;  ///< of the options of the run as a whole
  const Options& options_;    ///< of the run as a whole
  RunRecord& record_;
  Console& console_;
  OutputFolder folder_;
  std::vector<std::string> figures_;      ///< lines about the objects for a person who watches
  std::unique_ptr<Hdf5File> checkpoint_;  ///< from which the run goes on
};

}  // namespace

void run_objects(MPI_Comm comm, const std::deque<ObjectOptions>& objects, RunRecord record) {
  const RunPlan plan = plan_run({objects.begin(), objects.end()});
  const Options& options = plan.objects.front().options;
  require_valid(options.time);
  Console console(comm, options.output.monitor);
  console.say(record.program + " " + record.revision);
  if (!options.replay.empty()) {
    replay(comm, options.replay);
    return;
  }
  if (options.mesh_only) {
    mesh_only(comm, plan, std::move(record));
    return;
  }
  for (const std::string& line : plan.lines()) {
    console.say(line);
  }
  Run(comm, plan, objects.front().table, record, console).run();
}

}  // namespace pellicle::run
