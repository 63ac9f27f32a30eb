#pragma once

#include <mpi.h>

#include <functional>
#include <map>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "io/open_file.h"
#include "io/output_options.h"
#include "io/run_record.h"
#include "options/spelling.h"

namespace pellicle::io {

/// Names that have to differ, of the files in a folder or of the columns of a table, each with the option that chooses
/// it. Case is ignored, as some file systems, and some programs that read tables, do.
class DistinctNames {
 public:
  /// @param kind of the named things, "file" or "column" @param place where they have to differ, " of history.csv"
  explicit DistinctNames(std::string kind, std::string place = "") : kind_(std::move(kind)), place_(std::move(place)) {}

  /// @param owner key of the option, "bodies.ball"; empty: the program chooses the name
  /// @throws Error, which names both owners, if another has the name
  void add(const std::string& name, const std::string& owner) {
    const auto [first, is_new] = named_.emplace(in_lower_case(name), Named{name, owner});
    if (!is_new) {
      const auto words = [](const std::string& owner) { return owner.empty() ? "the program itself" : owner; };
      const bool is_same = first->second.name == name;
      throw Error(words(first->second.owner) + " and " + words(owner) + " both name the " + kind_ + " " + name +
                  (is_same ? "" : " (or " + first->second.name + ", which differs by upper and lower case alone)") +
                  place_ + "; expected another name of one of them");
    }
  }

 private:
  struct Named {
    std::string name;
    std::string owner;
  };

  std::string kind_;
  std::string place_;
  std::map<std::string, Named> named_;  ///< by the name in lower case
};

/// The folder of a run: used by one run at a time, and by runs of one name only. `run_files.txt` in it lists every file
/// that the run writes; the next run of this name removes the listed files alone. During the run the list is locked, by
/// a system lock that ends with the process (on one machine, and between machines as far as their file system supports
/// locks).
///
/// A file is made in the subfolder `run.part` and moved to its place when it is complete.
class OutputFolder {
 public:
  /// Locks a folder that a run has used before. Writes nothing. Collective.
  /// @param record of the run, written when the folder is started; must outlive the folder
  /// @throws Error, on all ranks: another run is active in the folder, or it is that of a run of another name, or it
  /// has a file that this run would replace and that is not listed or has been changed
  OutputFolder(MPI_Comm comm, const OutputOptions& options, const RunRecord& record);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Makes and locks the folder, writes the record (record_files) and removes the other files of the previous run. Does
  /// nothing the second time. Collective. @throws Error, on all ranks
  void start();

  /// Makes start() keep the previous run's files for which `stays` holds, since the run continues them. To be called
  /// before start().
  void keep(std::function<bool(const std::string& name)> stays) { stays_.push_back(std::move(stays)); }

  /// Reserves the name of a file for its writer. Not collective: the same on all ranks.
  /// @param owner as for DistinctNames @throws Error if another file has the name, or if it is too long for file
  /// systems
  void reserve(const std::string& name, const std::string& owner);

  MPI_Comm comm() const { return comm_; }
  const std::string& directory() const { return directory_; }
  std::string path(const std::string& name) const { return directory_ + "/" + name; }
  /// Path at which a file of a given name is made before it is put in place.
  std::string path_of_part(const std::string& name) const { return path("run.part/" + name); }

  /// Lists files, names in the folder, before they are made. On rank 0. @throws Error, also as require_present does
  void list(const std::vector<std::string>& names);
  /// Removes a listed file. On rank 0.
  void remove(const std::string& name);
  /// Writes a listed file, or replaces it atomically. On rank 0. @throws Error
  void write(const std::string& name, const std::string& text);
  /// Moves a finished file to its place. On any rank. @throws Error
  void put_in_place(const std::string& name);
  /// Removes unfinished files. On rank 0.
  void remove_parts();

  /// Checks the folder, on rank 0. @throws Error if the folder or its list has been removed or replaced since the
  /// start; both have then been made again, if possible, so that further files can be written.
  void require_present();

 private:
  /// Listed files by name; for a text the check sums that it may have.
  using Files = std::map<std::string, std::vector<std::string>>;
  enum class Missing { leave, make };

  void using_folder(const std::function<void()>& work);
  void open_list(Missing missing);
  void read_list();
  std::string listed(const Files& files, bool with_head) const;
  bool is_of_run(const std::string& name) const;
  void check_conflicts() const;
  void write_record();

  MPI_Comm comm_;
  std::string directory_;
  std::string name_;  ///< of the run
  const RunRecord& record_;
  std::regex tables_;  ///< names of tables and checkpoints of a run
  DistinctNames names_{"file"};
  std::regex frames_;  ///< what follows the run's name in names of frames
  bool is_started_ = false;
  OpenFile list_;  ///< on rank 0, locked
  Files files_;    ///< on rank 0
  std::vector<std::function<bool(const std::string&)>> stays_;
};

}  // namespace pellicle::io
