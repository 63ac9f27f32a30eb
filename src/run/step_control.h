#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/console.h"
#include "run/checkpoints.h"
#include "state/hdf5_file.h"
#include "world/options.h"
#include "world/stage.h"

namespace pellicle::run {

/// A run that is stepped and written, in practice a WorldOutput. All calls are collective.
class SteppedRun {
 public:
  virtual ~SteppedRun() = default;

  // The functions of the state do what those of the same names of World do.

  virtual double time() const = 0;
  virtual int step() const = 0;
  virtual double& length() = 0;
  virtual StepResult advance(double h) = 0;
  virtual void accept(double time) = 0;
  virtual void keep() = 0;
  virtual void restore() = 0;
  virtual std::string ended() const { return ""; }
  virtual std::vector<std::string> remarks() const { return {}; }

  // The functions below write the run's output.

  /// Whether a frame of the present state is due.
  virtual bool frame_due() const = 0;
  /// The time of the next frame [s], where frames come by time; adaptive steps end there.
  virtual std::optional<double> next_frame_time() const = 0;
  /// Writes a frame, if there is none of this step. The first one makes the output folder.
  virtual void draw() = 0;
  /// Writes the present state, after a step of length h that has failed, as a frame of a series of its own. Numbers
  /// that are not finite become 0. @returns its file, and a remark on the state @throws Error, on all ranks
  virtual std::string draw_failed(double h) = 0;
  /// Writes all that is needed to go on from the present state and behind the present output. @throws Error, on all
  /// ranks
  virtual void save(Hdf5File& checkpoint) const = 0;
  /// Adds a row to the history, about the last step. @param retries how often it was tried again
  virtual void record(int retries) = 0;
};

/// Steps to the end of the run, or until it has ended by itself; the caller writes the first frame and row.
///
/// A step that fails is undone and tried again with half its length, down to `time.step` halved `time.max_retries`
/// times, so that however hard a run becomes its steps do not become ever shorter. Afterwards the length doubles up to
/// `time.step`. With `time.tolerance` > 0 the next length follows from the estimated error e of the step instead, h
/// times sqrt(tolerance/e), or with generalized alpha the cube root, within the bounds of the options. Collective.
/// A signal to end the run (see stop_signal.h) ends it after the step in which it came, whose frame and row are
/// written.
/// @throws Error when a step failed at every length tried, after the state in which the last try failed and the last
/// good state have been drawn; or when a frame or row could not be written, after the other one has been; Interrupted,
/// on a signal
/// Checkpoints are written where they are due and at the end, however the run ends.
void run_steps(SteppedRun& run, const TimeOptions& options, Console& console, Checkpoints* checkpoints = nullptr);

}  // namespace pellicle::run
