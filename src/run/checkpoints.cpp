#include "run/checkpoints.h"

#include <fcntl.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <set>

#include "base/error.h"
#include "io/open_file.h"
#include "options/deck.h"
#include "options/options.h"
#include "parallel/collective.h"
#include "run/step_control.h"

namespace pellicle::run {

namespace {

namespace fs = std::filesystem;

constexpr int format = 4;

/// The name of a table about a deck of the run. @param deck its number, from 0 @param what "text" or "source", the file
/// that it comes from
std::string deck_table(std::size_t deck, const std::string& what) {
  return "decks/" + std::to_string(deck + 1) + "/" + what;
}

/// The last line of a checkpoint. @param bytes before it
std::string last_line(unsigned long sum, long long bytes) {
  return fmt::format("\npellicle checkpoint crc32 {:08x} bytes {:016d}\n", sum, bytes);
}

/// The paths of the checkpoints in a folder, by their steps. Not collective.
std::map<int, std::string> checkpoints_in(const std::string& folder) {
  static const std::regex checkpoint(R"(checkpoint_([0-9]{6,9})\.h5)");
  std::map<int, std::string> found;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    std::smatch match;
    if (std::regex_match(name, match, checkpoint)) {
      found[std::stoi(match[1].str())] = entry.path().string();
    }
  }
  return found;
}

/// Opens a checkpoint. Collective. @throws Error, on all ranks, with what is wrong with the file
std::unique_ptr<Hdf5File> open_sound(MPI_Comm comm, const std::string& path) {
  long long bytes = -1;
  unsigned long sum = 0;
  on_root(comm, [&] {
    const std::size_t length = last_line(0, 0).size();
    const OpenFile file(path, O_RDONLY);
    if (!file.is_open()) {
      throw Error("it cannot be opened");
    }
    const long long size = file.size();
    std::string line(length, ' ');
    const long long start = size - static_cast<long long>(length);
    if (start < 0 || pread(file.descriptor(), line.data(), length, start) != static_cast<ssize_t>(length) ||
        std::sscanf(line.c_str(), "\npellicle checkpoint crc32 %lx bytes %lld", &sum, &bytes) != 2 || bytes != start ||
        line != last_line(sum, bytes)) {
      throw Error("its end is missing");
    }
  });
  MPI_Bcast(&bytes, 1, MPI_LONG_LONG, 0, comm);
  MPI_Bcast(&sum, 1, MPI_UNSIGNED_LONG, 0, comm);
  if (file_checksum(comm, path, bytes) != sum) {
    throw Error("its check sum is not that of its contents");
  }
  auto file = std::make_unique<Hdf5File>(comm, path, Hdf5File::Mode::read);
  if (file->read_all<int>("format") != std::vector<int>{format}) {
    throw Error("it is of another format than " + std::to_string(format));
  }
  return file;
}

/// "objects.cloth" for the key "objects.cloth.heat.capacity"; "" for a key of the run, or of an object without a name.
std::string object_of(const std::string& key) {
  const std::string start = "objects.";
  return key.compare(0, start.size(), start) == 0 ? key.substr(0, key.find('.', start.size())) : "";
}

/// Whether a run may go on with another value.
bool may_change(const OptionTable& table, const std::string& key) {
  if (key == "time.scheme" || key == "time.arc_length") {  // With another one a run goes on from other fields.
    return false;
  }
  const std::string group = key.substr(0, key.find('.'));
  const auto& options = table.options();
  const auto option =
      std::find_if(options.begin(), options.end(), [&key](const Option& one) { return one.key() == key; });
  return group == "output" || group == "checkpoint" || group == "time" || group == "petsc" || group == "restart" ||
         group == "verify_restart" || (option != options.end() && option->is_solver_setting());
}

}  // namespace

Checkpoints::Checkpoints(OutputFolder& folder, const CheckpointOptions& options, const RunRecord& record, int present)
    : folder_(folder), options_(options), record_(record), start_(MPI_Wtime()) {
  if (present < 0) {
    return;
  }
  on_root(folder_.comm(), [&] {
    for (const auto& found : checkpoints_in(folder_.directory())) {
      if (found.first <= present) {
        written_.push_back(found.first);
      }
    }
  });
  written_ = of_all_ranks(folder_.comm(), written_);
  const auto count = std::min(static_cast<int>(written_.size()), std::max(options_.keep, 1));
  written_.erase(written_.begin(), written_.end() - count);
  folder_.keep([steps = written_](const std::string& file) {
    return std::any_of(steps.begin(), steps.end(), [&file](int step) { return file == name_of(step); });
  });
}

std::string Checkpoints::name_of(int step) { return fmt::format("checkpoint_{:06d}.h5", step); }

bool Checkpoints::due_by_clock(int step) const {
  if (!lacks(step)) {
    return false;
  }
  const double now = MPI_Wtime();
  const double interval = options_.wall_interval(now - start_, !last_);
  bool is_due = interval > 0 && now - last_.value_or(start_) >= interval;
  MPI_Bcast(&is_due, 1, MPI_CXX_BOOL, 0, folder_.comm());
  return is_due;
}

void Checkpoints::write(const SteppedRun& run) {
  const int step = run.step();
  if (!lacks(step)) {
    return;
  }
  MPI_Comm comm = folder_.comm();
  const std::string name = name_of(step);
  const std::string part = folder_.path_of_part(name);
  on_root(comm, [&] { folder_.list({name}); });
  try {
    Hdf5File file(comm, part, Hdf5File::Mode::create);
    file.write_once("format", std::vector<int>{format});
    file.write_text("program", record_.program + " " + record_.revision);
    file.write_text("options", record_.options);
    for (std::size_t k = 0; k < record_.decks.size(); ++k) {
      file.write_text(deck_table(k, "text"), record_.decks[k].text);
      file.write_text(deck_table(k, "source"), fs::absolute(record_.decks[k].source()).string());
    }
    std::vector<std::string> inputs;
    for (const InputFile& input : record_.inputs) {
      inputs.push_back(input.checksum + " " + input.key);
    }
    file.write_lines("inputs", inputs);
    file.write_lines("object_names", record_.objects);
    file.write_lines("mesh", record_.mesh);
    run.save(file);
    file.close();
    long long bytes = 0;
    on_root(comm, [&] { bytes = OpenFile(part, O_RDONLY).size(); });
    MPI_Bcast(&bytes, 1, MPI_LONG_LONG, 0, comm);
    const unsigned long sum = file_checksum(comm, part, bytes);
    on_root(comm, [&] {
      OpenFile whole(part, O_RDWR);
      whole.append(last_line(sum, bytes));
      fsync(whole.descriptor());
      folder_.put_in_place(name);
      if (const OpenFile folder(folder_.directory(), O_RDONLY); folder.is_open()) {
        fsync(folder.descriptor());
      }
    });
  } catch (const Error& error) {
    std::string space;
    on_root(comm, [&] {
      std::error_code unknown;
      const fs::space_info disk = fs::space(folder_.directory(), unknown);
      space = unknown ? "" : ", " + std::to_string(disk.available) + " bytes are free";
      folder_.remove_parts();
    });
    broadcast(comm, space);
    throw Error(error.what() + space + "; " +
                (written_.empty() ? "there is no checkpoint before it" : "the checkpoint before it is " + newest()));
  }
  written_.push_back(step);
  last_ = MPI_Wtime();
  while (written_.size() > static_cast<std::size_t>(options_.keep)) {
    on_root(comm, [&] { folder_.remove(name_of(written_.front())); });
    written_.erase(written_.begin());
  }
}

std::unique_ptr<Hdf5File> open_checkpoint(MPI_Comm comm, const std::string& path, Console& console) {
  std::vector<std::string> candidates;  // the newest first
  on_root(comm, [&] {
    std::error_code none;
    if (!fs::exists(path, none)) {
      throw Error("restart: " + path + " is not there; expected a checkpoint or the folder of a run");
    }
    if (!fs::is_directory(path, none)) {
      candidates = {path};
      return;
    }
    const std::map<int, std::string> found = checkpoints_in(path);
    for (auto newest = found.rbegin(); newest != found.rend(); ++newest) {
      candidates.push_back(newest->second);
    }
  });
  broadcast(comm, candidates);
  std::string faults;
  for (const std::string& candidate : candidates) {
    try {
      return open_sound(comm, candidate);
    } catch (const Error& error) {
      console.tell(candidate + " is damaged and passed over: " + error.what());
      faults += "; " + candidate + ": " + error.what();
    }
  }
  throw Error("restart: " + path + " has no sound checkpoint" + faults);
}

std::vector<Deck> decks_of(const Hdf5File& checkpoint) {
  std::vector<Deck> decks;
  while (checkpoint.has(deck_table(decks.size(), "text"))) {
    const std::size_t k = decks.size();
    decks.push_back({checkpoint.read_text(deck_table(k, "source")), checkpoint.read_text(deck_table(k, "text"))});
  }
  return decks;
}

void require_same_run(const OptionTable& table, const Hdf5File& checkpoint, const RunRecord& now) {
  const std::vector<std::string> inputs = checkpoint.read_lines("inputs");
  std::vector<std::string> faults;
  std::set<std::string> same_files;  // keys of files whose content is the same, wherever they are
  for (const InputFile& file : now.inputs) {
    if (std::find(inputs.begin(), inputs.end(), file.checksum + " " + file.key) != inputs.end()) {
      same_files.insert(file.key);
    }
  }
  std::set<std::string> named;  // objects of which only one of the runs has any option
  const std::vector<ChangedOption> changed = changed_options(checkpoint.read_text("options"), now.options);
  for (const ChangedOption& option : changed) {
    const std::string object = object_of(option.key);
    const bool is_of_one =
        !object.empty() && option.key == object + ".chain" && (option.before.empty() || option.now.empty());
    if (is_of_one) {
      faults.push_back(object + ": " + (option.now.empty() ? "not given, was an object" : "was no object"));
      named.insert(object);
    }
  }
  for (const ChangedOption& option : changed) {
    const std::string object = object_of(option.key);
    if (named.count(object) == 0 && same_files.count(option.key) == 0 &&
        !may_change(table, object.empty() ? option.key : option.key.substr(object.size() + 1))) {
      const auto said = [](const std::string& value) { return value.empty() ? "not given" : value; };
      faults.push_back(option.key + ": " + said(option.now) + ", was " + said(option.before));
    }
  }
  if (named.empty() && checkpoint.read_lines("object_names") != now.objects) {  // Frames number the objects.
    faults.emplace_back("objects: in another order than they were");
  }
  if (!faults.empty()) {
    throw Error(fmt::format(
        "restart: {}; expected the options of the run that goes on, but for its solvers, time, output and checkpoints",
        fmt::join(faults, "; ")));
  }
  for (const InputFile& file : now.inputs) {
    const bool is_other_option = std::any_of(changed.begin(), changed.end(),
                                             [&file](const ChangedOption& option) { return option.key == file.key; });
    if (!file.checksum.empty() && same_files.count(file.key) == 0 && !is_other_option) {
      throw Error("restart: " + file.key + ": " + file.path +
                  " has been changed since the run began; expected the file as it was, or a new run");
    }
  }
}

}  // namespace pellicle::run
