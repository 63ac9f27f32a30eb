#pragma once

#include <string>
#include <vector>

#include "io/open_file.h"
#include "io/output_folder.h"
#include "state/hdf5_file.h"

namespace pellicle {
inline namespace io {

/// Keeps the tables of a checkpoint (History::save), with which a run goes on, in its folder, which is not started yet.
/// Collective. @throws Error, on all ranks, when one is not there or shorter than it was
void keep_tables(OutputFolder& folder, const Hdf5File& checkpoint);

/// A table of numbers over time in a CSV file, which grows by a row a step and can be read at any moment.
class History {
 public:
  struct Column {
    std::string name;
    std::string unit;        ///< SI, as in "kg"; empty for a pure number
    std::string owner = {};  ///< key of the option that gives the name, "bodies.ball"; empty: the program
  };

  /// Touches no file. @param owner of the table's name, see OutputFolder::reserve
  /// @throws Error, the same on all ranks, if two columns, or two files of the run, have the same name
  History(OutputFolder& folder, std::string name, std::vector<Column> columns, const std::string& owner = "");

  /// Makes the file, in a folder that it starts, and writes the line of names: `time [s],step,mass_left [kg]`. Does
  /// nothing where that has been done; `add` does it, too. Collective. @throws Error, on all ranks, if that fails.
  void start();
  /// Goes on with the file of the run that has written a checkpoint, in its folder, see keep_tables: rows that were
  /// added after it are cut off. If it had no such file, this one is made. Collective. @throws Error, on all ranks
  void resume(const Hdf5File& checkpoint);

  /// Notes in a checkpoint how far the table is. Collective. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;

  /// Adds a row, one value a column in their order, with all digits. The values of rank 0 count. Collective.
  /// @throws Error, on all ranks, when the file cannot be written: it keeps complete rows only; or when it has been
  /// removed or replaced: then all rows have been written again, to `rescued_<name>` if another file is in its place;
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

}  // namespace io
}  // namespace pellicle
