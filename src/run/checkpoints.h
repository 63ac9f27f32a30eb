#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/console.h"
#include "io/output_folder.h"
#include "state/hdf5_file.h"
#include "world/options.h"

namespace pellicle::run {

class SteppedRun;

/// The checkpoints of a run, `checkpoint_000120.h5` in its folder after step 120: all that is needed to go on from
/// there on any number of ranks. A file is put in its place when it is complete; its last line has the check sum of the
/// rest.
class Checkpoints {
 public:
  /// Folder and record must outlive it. Collective.
  /// @param present step of a checkpoint of this run in the folder, from which it goes on; earlier ones stay, up to the
  /// number to be kept; -1: there is none
  Checkpoints(OutputFolder& folder, const CheckpointOptions& options, const RunRecord& record, int present);

  /// Whether there is to be a checkpoint of a step if the run ends there, and is none yet. Not collective.
  bool lacks(int step) const { return options_.keep > 0 && (written_.empty() || written_.back() != step); }
  /// Whether a checkpoint is due after this step by the number of steps, and there is none yet. Not collective.
  bool due_by_steps(int step) const {
    return lacks(step) && options_.interval_steps > 0 && step % options_.interval_steps == 0;
  }
  /// Whether a checkpoint is due after this step by the clock on the wall, and there is none yet. Collective.
  bool due_by_clock(int step) const;
  /// Writes one of the present state, if there is none of its step; removes those that are too old. Collective.
  /// @throws Error, on all ranks, when it cannot be written: earlier ones stay
  void write(const SteppedRun& run);

  /// The newest one, with its folder; empty: there is none.
  std::string newest() const { return written_.empty() ? "" : folder_.path(name_of(written_.back())); }

 private:
  static std::string name_of(int step);
  OutputFolder& folder_;
  CheckpointOptions options_;
  const RunRecord& record_;
  std::vector<int> written_;    ///< steps, rising
  double start_;                ///< on the wall, of the run [s]
  std::optional<double> last_;  ///< on the wall, of the last checkpoint that it has written [s]
};

/// The newest intact checkpoint of a folder, or the one of a file. Damaged ones are reported and skipped. Collective.
/// @throws Error, on all ranks, when there is none
std::unique_ptr<Hdf5File> open_checkpoint(MPI_Comm comm, const std::string& path, Console& console);

/// Refuses options that may not change when a run goes on, and files with another content than they had: a file may
/// have been moved. Collective. @throws Error, on all ranks, that names them
/// @param now the record of the run that goes on
void require_same_run(const OptionTable& table, const Hdf5File& checkpoint, const RunRecord& now);

/// The decks of the run that wrote a checkpoint. Collective. @throws Error, on all ranks
std::vector<Deck> decks_of(const Hdf5File& checkpoint);

}  // namespace pellicle::run
