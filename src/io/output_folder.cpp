#include "io/output_folder.h"

#include <fcntl.h>
#include <sys/file.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <set>
#include <sstream>

namespace pellicle::io {

namespace {

namespace fs = std::filesystem;

const char* const list_name = "run_files.txt";
const char* const parts_name = "run.part";

/// Whether a name can be that of a file of a run, in the folder or in a subfolder.
bool is_inside(const std::string& name) {
  const fs::path path(name);
  const auto parts = std::distance(path.begin(), path.end());
  return path.is_relative() && (parts == 1 || parts == 2) && name != list_name &&
         std::none_of(path.begin(), path.end(),
                      [](const fs::path& part) { return part.empty() || part == "." || part == ".."; });
}

/// Whether a path is a regular file, neither a link nor behind one below the folder.
bool is_file_inside(const std::string& folder, const std::string& name) {
  const fs::path parent = fs::path(name).parent_path();
  return fs::symlink_status(fs::path(folder) / name).type() == fs::file_type::regular &&
         (parent.empty() || fs::symlink_status(fs::path(folder) / parent).type() == fs::file_type::directory);
}

/// Removes the named files that exist, then subfolders that have become empty.
template <class Names>
void remove_files(const std::string& folder, const Names& names) {
  std::set<std::string> subfolders;
  for (const auto& [name, sums] : names) {
    if (is_file_inside(folder, name)) {
      fs::remove(fs::path(folder) / name);
    }
    if (fs::path(name).has_parent_path()) {
      subfolders.insert(fs::path(name).parent_path().string());
    }
  }
  for (const std::string& subfolder : subfolders) {
    const fs::path path = fs::path(folder) / subfolder;
    if (fs::symlink_status(path).type() == fs::file_type::directory && fs::is_empty(path)) {
      fs::remove(path);
    }
  }
}

}  // namespace

OutputFolder::OutputFolder(MPI_Comm comm, const OutputOptions& options, const RunRecord& record)
    : comm_(comm), directory_(options.directory), name_(options.name), record_(record) {
  options.validate();
  // "(_cloth|_lantern)"
  const std::string of_object = record_.objects.empty() ? "" : "(_" + join(record_.objects, "|_") + ")";
  tables_ = "checkpoint_[0-9]{6,}\\.h5|contacts\\.csv|(history|pieces|projection)" + of_object + "\\.csv";
  frames_ = "((_failed)?(_springs)?|_bodies)\\.pvd|((_failed)?(_springs)?" + of_object +
            "|_bodies_[A-Za-z0-9_]+)_[0-9]{6,}(\\.pvtp|/.*_[0-9]{6,}_[0-9]+\\.vtp)";
  using_folder([this] {
    open_list(Missing::leave);
    check_conflicts();
  });
}

OutputFolder::~OutputFolder() {
  if (is_started_ && rank_of(comm_) == 0) {
    remove_parts();
    std::error_code ignored;
    fs::remove(path(parts_name), ignored);
  }
}

void OutputFolder::start() {
  if (std::exchange(is_started_, true)) {
    return;
  }
  using_folder([this] {
    fs::create_directories(directory_);
    if (!list_.is_at(path(list_name))) {
      open_list(Missing::make);
    }
    check_conflicts();
    // The new record is written before the old one is removed: a deck that a run has kept may be the one that is run.
    const Files old = std::exchange(files_, {});
    write_record();
    Files series;  // removed first, so that they never name frames that are gone
    Files others;
    for (const auto& file : old) {
      const bool stays =
          std::any_of(stays_.begin(), stays_.end(), [&](const auto& keeps) { return keeps(file.first); });
      if (files_.count(file.first) == 0) {
        (stays ? files_ : fs::path(file.first).extension() == ".pvd" ? series : others).insert(file);
      }
    }
    for (const Files& files : {series, others}) {
      remove_files(directory_, files);
      remove_files(path(parts_name), files);
    }
    list_.overwrite(listed(files_, true));
  });
}

void OutputFolder::using_folder(const std::function<void()>& work) {
  on_root(comm_, [&] {
    try {
      work();
    } catch (const fs::filesystem_error& error) {
      throw Error("output.directory: " + directory_ + " cannot be used: " + error.code().message());
    }
  });
}

void OutputFolder::open_list(Missing missing) {
  const std::string path_of_list = path(list_name);
  OpenFile list(path_of_list, O_RDWR | (missing == Missing::make ? O_CREAT : 0));
  if (!list.is_open() && missing == Missing::leave && (list.error() == ENOENT || list.error() == ENOTDIR)) {
    return;
  }
  if (!list.is_open()) {
    throw Error("output.directory: " + path_of_list + " cannot be opened: " + std::strerror(list.error()));
  }
  // A file system without locks gives another error: then the run goes on without one.
  if (flock(list.descriptor(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    throw Error("output.directory: " + directory_ +
                ": another run is writing there; expected a folder of its own, or that it has ended");
  }
  list_ = std::move(list);
  read_list();
}

void OutputFolder::read_list() {
  files_.clear();
  std::istringstream text(list_.text());
  std::string line;
  if (!std::getline(text, line)) {
    return;
  }
  if (!starts_with(line, "run ")) {
    throw Error("output.directory: " + path(list_name) +
                " is no list of the files of a run; expected 'run NAME' in its first line");
  }
  if (line.substr(4) != name_) {
    throw Error("output.directory: " + directory_ + " is the folder of the run '" + line.substr(4) +
                "'; expected one of its own for '" + name_ + "'");
  }
  for (int number = 2; std::getline(text, line); ++number) {
    std::istringstream words(line);
    std::string kind;
    std::string sum;
    words >> kind;
    const bool is_text = kind == "text" && words >> sum;
    if (kind != "file" && !is_text) {
      continue;  // the end of an older list, left by a run that was killed while it shortened it
    }
    std::string name;
    std::getline(words >> std::ws, name);
    if (!is_inside(name)) {
      throw Error("output.directory: " + path(list_name) + ":" + std::to_string(number) + ": '" + name +
                  "' is no file in this folder; expected names of files in it");
    }
    std::vector<std::string>& sums = files_[name];
    if (is_text) {
      sums.push_back(sum);
    }
  }
}

std::string OutputFolder::listed(const Files& files, bool with_head) const {
  std::string lines = with_head ? "run " + name_ + "\n" : "";
  for (const auto& [name, sums] : files) {
    if (sums.empty()) {
      lines += "file " + name + "\n";
    }
    for (const std::string& sum : sums) {
      lines += "text " + sum + " " + name + "\n";
    }
  }
  return lines;
}

bool OutputFolder::is_of_run(const std::string& name) const {
  return std::regex_match(name, tables_) ||
         (starts_with(name, name_) && std::regex_match(name.substr(name_.size()), frames_));
}

void OutputFolder::check_conflicts() const {
  const std::map<std::string, std::string> record = record_files(record_, ranks_of(comm_));
  std::vector<std::string> names;
  for (const auto& [name, text] : record) {
    names.push_back(name);
  }
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory_, none)) {
    const std::string name = entry.path().filename().string();
    names.push_back(name);
    if (is_of_run(name + ".pvtp") && entry.is_directory()) {
      for (const fs::directory_entry& piece : fs::directory_iterator(entry)) {
        names.push_back(name + "/" + piece.path().filename().string());
      }
    }
  }
  for (const std::string& name : names) {
    // A folder of this name belongs to the list, if a list exists.
    const bool is_foreign_parts = name == parts_name && files_.empty();
    const bool would_be_replaced = is_foreign_parts || record.count(name) > 0 || is_of_run(name);
    if (would_be_replaced && fs::exists(fs::symlink_status(path(name))) &&
        (files_.count(name) == 0 || !is_file_inside(directory_, name))) {
      throw Error("output.directory: " + path(name) + " is there and " + path(list_name) +
                  " does not name it as a run's; expected another folder, or that you move it");
    }
  }
  for (const auto& [name, sums] : files_) {
    if (sums.empty() || !is_file_inside(directory_, name)) {
      continue;
    }
    const OpenFile file(path(name), O_RDONLY);
    const std::string text = file.is_open() ? file.text() : "";
    const auto written = record.find(name);
    const bool stays = written != record.end() && written->second == text;
    if (!stays && std::find(sums.begin(), sums.end(), checksum_of(text)) == sums.end()) {
      throw Error("output.directory: " + path(name) +
                  " has been changed since a run wrote it; expected another folder, or that you move it");
    }
  }
}

void OutputFolder::write_record() {
  const std::map<std::string, std::string> record = record_files(record_, ranks_of(comm_));
  Files texts;
  for (const auto& [name, text] : record) {
    texts[name] = {checksum_of(text)};
  }
  list_.append(listed(texts, list_.text().empty()));
  files_.insert(texts.begin(), texts.end());
  fs::create_directory(path(parts_name));
  for (const auto& [name, text] : record) {
    write(name, text);
  }
}

void OutputFolder::reserve(const std::string& name, const std::string& owner) {
  constexpr std::size_t longest = 255;
  if (name.size() > longest) {
    throw Error(owner + ": the file " + name + " would have a name of " + std::to_string(name.size()) +
                " bytes; expected " + std::to_string(longest) + " at most");
  }
  names_.add(name, owner);
}

void OutputFolder::list(const std::vector<std::string>& names) {
  require_present();
  Files files;
  for (const std::string& name : names) {
    if (files_.count(name) == 0) {
      files[name] = {};
    }
  }
  list_.append(listed(files, false));
  files_.insert(files.begin(), files.end());
  std::error_code ignored;  // Files in it then fail.
  fs::create_directory(path(parts_name), ignored);
}

void OutputFolder::remove(const std::string& name) {
  std::error_code ignored;  // The next run of this name removes what is left.
  if (is_file_inside(directory_, name)) {
    fs::remove(path(name), ignored);
  }
}

void OutputFolder::write(const std::string& name, const std::string& text) {
  {
    OpenFile file(path_of_part(name), O_WRONLY | O_CREAT | O_TRUNC);
    file.append(text);
  }
  put_in_place(name);
}

void OutputFolder::put_in_place(const std::string& name) {
  if (std::rename(path_of_part(name).c_str(), path(name).c_str()) != 0) {
    throw Error(path(name) + ": cannot be written: " + std::strerror(errno));
  }
}

void OutputFolder::remove_parts() {
  try {
    remove_files(path(parts_name), files_);
  } catch (const fs::filesystem_error&) {  // The next run removes what is left.
  }
}

void OutputFolder::require_present() {
  if (list_.is_at(path(list_name))) {
    return;
  }
  const std::string what =
      directory_ + ": the folder, or " + list_name + " in it, was removed or replaced while the run went on";
  Files files = files_;
  try {
    fs::create_directories(directory_);
    open_list(Missing::make);
    files_.insert(files.begin(), files.end());
    list_.overwrite(listed(files_, true));
    write_record();
  } catch (const std::exception& error) {
    throw Error(what + ", and it cannot be made again: " + error.what());
  }
  throw Error(what + "; what could be kept is there");
}

}  // namespace pellicle::io
