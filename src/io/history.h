#pragma once

#include <string>
#include <vector>

#include "io/open_file.h"
#include "io/output_folder.h"
#include "state/hdf5_file.h"

namespace pellicle::io {

/// Keeps the tables of a checkpoint (History::save) from which a run continues, before its folder is started.
/// Collective. @throws Error, on all ranks, if one is missing or shorter than it was
void keep_tables(OutputFolder& folder, const Hdf5File& checkpoint);

/// A table of numbers over time in a CSV file, which grows by a row each step and can be read at any time.
class History {
 public:
  struct Column {
    std::string name;
    std::string unit;        ///< SI, as in "kg"; empty for a pure number
    std::string owner = {};  ///< key of the option that gives the name, "bodies.ball"; empty: the program
  };

  /// Touches no file. @param owner of the table's name, as for OutputFolder::reserve
  /// @throws Error, the same on all ranks, if two columns, or two files of the run, have the same name
  History(OutputFolder& folder, std::string name, std::vector<Column> columns, const std::string& owner = "");

  /// Starts the folder, makes the file and writes the line of names: `time [s],step,mass_left [kg]`. Does nothing if
  /// that has been done; `add` calls it, too. Collective. @throws Error, on all ranks, if that fails.
  void start();
  /// Continues the file of the run that has written a checkpoint, in its folder (keep_tables): rows that were added
  /// after the checkpoint are cut off. A missing file is made. Collective. @throws Error, on all ranks
  void resume(const Hdf5File& checkpoint);

  /// Writes the length of the table to a checkpoint. Collective. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;

  /// Adds a row of rank 0's values, one for each column in their order, with all digits. Collective.
  /// @throws Error, on all ranks, if the file cannot be written: it keeps complete rows only; or if it has been removed
  /// or replaced: then all rows have been written again, to `rescued_<name>` if another file is in its place;
  /// std::logic_error on a wrong number of values.
  void add(const std::vector<double>& values);

 private:
  std::string head() const;
  void require_present();

  OutputFolder& folder_;
  std::string name_;
  std::vector<Column> columns_;
  bool is_started_ = false;
  OpenFile file_;  ///< open on rank 0 only
};

}  // namespace pellicle::io
