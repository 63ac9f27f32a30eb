#include "world/run.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

#include "base/error.h"
#include "base/stage_clock.h"
#include "base/units.h"
#include "io/console.h"
#include "parallel/collective.h"
#include "solvers/saved_system.h"
#include "surface/membrane.h"
#include "surface/shell.h"
#include "world/burn_run.h"
#include "world/gas_links.h"
#include "world/inflate_run.h"
#include "world/load_mesh.h"
#include "world/mesh_only.h"
#include "world/world.h"

namespace pellicle {
inline namespace world {

namespace {

/// The springs of each colour.
std::string spring_line(const Sheet& sheet) {
  std::string line = "springs:";
  for (const Colour colour : all_colours) {
    if (!sheet.acts(colour)) {
      continue;
    }
    line += std::string(" ") + colour_names[static_cast<std::size_t>(colour)] + " " +
            std::to_string(sheet.of(colour).layout.global);
  }
  return line;
}

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

/// A run: what makes its world, and its output.
class Run {
 public:
  Run(MPI_Comm comm, const std::deque<ObjectOptions>& objects, const std::vector<GroupPlan>& groups, RunRecord& record,
      Console& console)
      : comm_(comm),
        objects_(objects),
        groups_(groups),
        options_(objects.front().options),
        record_(record),
        console_(console),
        folder_(comm, options_.output, record) {
    keep_what_is_read();
  }

  /// The whole run. Collective.
  void run() {
    open_checkpoint();
    World world = make_world(checkpoint_.get(), folder_);
    const bool goes_on = goes_on_in_its_folder();
    Checkpoints checkpoints(folder_, options_.checkpoint, record_, goes_on ? world.step() : -1);
    begin_output(world, goes_on);
    if (options_.verify_restart > 0) {
      verify(world, checkpoints);
    } else {
      steps(world, checkpoints);
    }
  }

 private:
  /// The lines of an object that are left out when nobody watches.
  void add_figures(const ObjectOutput& output, const std::vector<std::string>& lines) {
    for (const std::string& line : lines) {
      figures_.push_back(output.heading() + line);
    }
  }

  /// Files that the run reads stay, though an earlier run has written them: the mesh of -mesh_only.
  void keep_what_is_read() {
    std::vector<std::string> files;
    for (const ObjectOptions& object : objects_) {
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

  std::unique_ptr<Object> object_from_mesh(const Options& options, const ObjectOutput& output) {
    LoadedMesh loaded = load_mesh(comm_, options);
    for (const std::string& line : loaded.lines) {
      record_.mesh.push_back(output.heading() + line);
    }
    add_figures(output, loaded.figures);
    if (options.chain == ChainKind::burn) {
      Sheet sheet = make_sheet(comm_, std::move(loaded.rows), shell_options(options));
      add_figures(output, {spring_line(sheet), partition_line(sheet)});
      return std::make_unique<BurnRun>(std::move(sheet), options, output);
    }
    Membrane membrane = make_membrane(comm_, std::move(loaded.rows), options.sheet).membrane;
    add_figures(output, {partition_line(membrane)});
    return std::make_unique<InflateRun>(std::move(membrane), options, output);
  }

  std::unique_ptr<Object> object_from(const Hdf5File& checkpoint, const Options& options, const ObjectOutput& output) {
    if (options.chain == ChainKind::burn) {
      auto sheet = std::make_unique<BurnRun>(checkpoint, options, output);
      add_figures(output, {spring_line(sheet->sheet()), partition_line(sheet->sheet())});
      return sheet;
    }
    auto balloon = std::make_unique<InflateRun>(checkpoint, options, output);
    add_figures(output, {partition_line(balloon->membrane())});
    return balloon;
  }

  bool is_coupled(std::size_t object) const {
    return std::any_of(groups_.begin(), groups_.end(), [object](const GroupPlan& group) {
      return !group.is_single() && std::find(group.objects.begin(), group.objects.end(), object) != group.objects.end();
    });
  }

  /// @param checkpoint null: the objects begin with their meshes
  World make_world(const Hdf5File* checkpoint, OutputFolder& folder) {
    std::vector<World::Member> members;
    for (const ObjectOptions& object : objects_) {
      const bool burns = object.options.chain == ChainKind::burn;
      World::Member& member = members.emplace_back();
      member.name = object.name;
      member.clock = std::make_unique<StageClock>(burns ? Burn::stage_names()
                                                        : Inflate::stage_names(balloon_burns(object.options)));
      const ObjectOutput output{folder, console_, *member.clock, object.name, is_coupled(members.size() - 1)};
      member.object = about_object(output.heading(), [&] {
        return checkpoint == nullptr ? object_from_mesh(object.options, output)
                                     : object_from(*checkpoint, object.options, output);
      });
    }
    std::vector<const ObjectOptions*> objects;
    for (const ObjectOptions& object : objects_) {
      objects.push_back(&object);
    }
    return {folder, options_.output, std::move(members), groups_, drawings_of_bodies(comm_, objects)};
  }

  /// The checkpoint from which the run goes on, if it does.
  void open_checkpoint() {
    if (!options_.restart.empty()) {
      checkpoint_ = pellicle::open_checkpoint(comm_, options_.restart, console_);
      require_same_run(objects_.front().table, *checkpoint_, record_);
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
    MPI_Bcast(&is_same, 1, MPI_CXX_BOOL, 0, comm_);
    return is_same;
  }

  /// The first frame and row, or the continuation of those of an earlier run. Lines about the mesh are printed only
  /// when the input is known to be good: bad input is refused by one line.
  void begin_output(World& world, bool goes_on) {
    if (goes_on) {
      keep_tables(folder_, *checkpoint_);
      world.resume_output(*checkpoint_);
    } else {
      world.draw();  // The first frame makes the folder, or refuses the chosen fields before anything is written.
      world.record(0, 0);
    }
    for (const std::string& line : record_.mesh) {
      console_.tell(line);
    }
    for (const std::string& line : world.first_remarks()) {
      console_.tell(line);
    }
    if (checkpoint_ != nullptr) {
      console_.tell("goes on from " + checkpoint_->path() + ": time " + time_text(world.time()) + ", step " +
                    std::to_string(world.step()));
      checkpoint_ = nullptr;
    }
    for (const std::string& line : figures_) {
      console_.say(line);
    }
  }

  void steps(World& world, Checkpoints& checkpoints) {
    try {
      run_steps(world, options_.time, console_, &checkpoints);
    } catch (const Error&) {
      tell_of(checkpoints);
      throw;
    }
    const std::vector<std::pair<std::string, const StageClock*>> clocks = world.clocks();
    console_.stage_table(clocks);
    console_.tell("done: time " + time_text(world.time()) + ", " + std::to_string(world.step()) + " steps in " +
                  duration_text(clocks.front().second->elapsed()) + "; " + options_.output.directory + "/" +
                  options_.output.name + ".pvd");
    tell_of(checkpoints, &world);
  }

  /// Whether steps from a checkpoint equal those of the run that continues without it. @throws Error if they do not
  void verify(World& world, Checkpoints& checkpoints) {
    TimeOptions time = options_.time;
    time.max_steps = world.step() + options_.verify_restart;
    run_steps(world, time, console_, &checkpoints);
    const int middle = world.step();
    time.max_steps = middle + options_.verify_restart;
    run_steps(world, time, console_);
    if (world.step() == middle) {
      throw Error("verify_restart: nothing is compared, since the run ends with step " + std::to_string(middle) +
                  " at " + time_text(world.time()) +
                  ", where it would go on from a checkpoint; expected a later end, such as by time.end");
    }

    OutputOptions output = options_.output;
    output.directory += "/verify_restart";
    OutputFolder folder(comm_, output, record_);
    const std::unique_ptr<Hdf5File> checkpoint = pellicle::open_checkpoint(comm_, checkpoints.newest(), console_);
    World again = make_world(checkpoint.get(), folder);
    again.draw();
    again.record(0, 0);
    run_steps(again, time, console_);

    std::string faults;
    std::size_t compared = 0;
    for (std::size_t i = 0; i < world.members().size(); ++i) {
      const World::Member& member = world.members()[i];
      for (const auto& [name, here] : differences(member.object->state(), again.members()[i].object->state())) {
        double difference = here;
        difference = max_over_ranks(comm_, difference);
        ++compared;
        if (difference > 0) {
          faults += (faults.empty() ? "" : ", ") + (member.name.empty() ? "" : member.name + "'s ") + name + " by " +
                    number_text(difference) + " of its largest";
        }
      }
    }
    const std::string what = "verify_restart: steps " + std::to_string(middle + 1) + " to " +
                             std::to_string(world.step()) + (world.step() < time.max_steps ? ", the last," : "") +
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
      const bool by_steps = options_.time.max_steps > 0 && ended->step() >= options_.time.max_steps;
      words += by_steps ? " -time_max_steps 0" : " -time_end LATER";
    }
    console_.tell(words);
  }

  MPI_Comm comm_;
  const std::deque<ObjectOptions>& objects_;
  const std::vector<GroupPlan>& groups_;  ///< of them
  const Options& options_;                ///< of the run as a whole
  RunRecord& record_;
  Console& console_;
  OutputFolder folder_;
  std::vector<std::string> figures_;      ///< lines about the objects for a person who watches
  std::unique_ptr<Hdf5File> checkpoint_;  ///< from which the run goes on
};

}  // namespace

void run(MPI_Comm comm, std::deque<ObjectOptions>& objects, RunRecord record) {
  for (const ObjectOptions& object : objects) {
    about_object(heading_of(object.name), [&object] { object.table.check_exclusions(); });
  }
  share_links(objects);
  const std::vector<GroupPlan> groups = plan_groups(objects);
  require_valid(objects.front().options.time);
  const OutputOptions& output = objects.front().options.output;
  Console console(comm, output.monitor);
  console.say(record.program + " " + record.revision);
  if (const std::string& file = objects.front().options.replay; !file.empty()) {
    replay(comm, file);
    return;
  }
  if (objects.front().options.mesh_only) {
    mesh_only(comm, objects, std::move(record));
    return;
  }
  for (const GroupPlan& group : groups) {
    if (!group.is_single()) {
      console.say(group.words());
    }
  }
  Run(comm, objects, groups, record, console).run();
}

}  // namespace world
}  // namespace pellicle
