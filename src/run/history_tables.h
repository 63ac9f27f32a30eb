#pragma once

#include <memory>

#include "io/history.h"
#include "io/output_folder.h"
#include "state/hdf5_file.h"
#include "world/object.h"

namespace pellicle::run {

/// The tables of an object: a row of history.csv for the initial state and for each step, where something burns the
/// pieces of each frame in pieces.csv, and with `project.monitor` the curves of Fig. 8 of the burning paper in
/// projection.csv. The tables of an object with a name have it in theirs. All calls are collective.
class HistoryTables {
 public:
  /// Touches no file. Folder and object must outlive it.
  /// @param contact_apart see Object::report
  /// @throws Error, the same on all ranks, if two columns, or two files, have the same name
  HistoryTables(OutputFolder& folder, Object& object, bool contact_apart);

  /// Adds the row of the last step. @param retries how often it was tried again
  void add_step(int retries);
  /// Adds a row for each piece of the present frame.
  void add_frame();

  /// Notes in a checkpoint how long the tables are. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;
  /// Goes on with the tables of the run that has written a checkpoint, in its folder. @throws Error, on all ranks
  void resume(const Hdf5File& checkpoint);

 private:
  Object& object_;
  bool contact_apart_;
  History history_;
  std::unique_ptr<History> pieces_;      ///< null: nothing burns
  std::unique_ptr<History> projection_;  ///< null: not asked for
};

}  // namespace pellicle::run
