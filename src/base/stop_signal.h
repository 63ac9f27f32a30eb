#pragma once

#include <mpi.h>

#include <functional>
#include <string>

#include "base/error.h"

namespace pellicle {
inline namespace base {

/// A run that a signal has ended; its state has been kept. `main` ends with 128 + the signal, as shells expect.
class Interrupted : public Error {
 public:
  Interrupted(int signal, const std::string& message) : Error(message), signal_(signal) {}
  int signal() const { return signal_; }

 private:
  int signal_;
};

/// From here on SIGTERM, SIGINT, SIGHUP, SIGUSR1, SIGUSR2 and SIGXCPU, by which people and batch systems end a run, end
/// this process at once, with a line on standard error and the exit code 128 + the signal. SIGHUP stays ignored under
/// nohup. SIGPIPE and SIGXFSZ are ignored: to write into a pipe that nobody reads, or beyond the largest size that a
/// file may have, is an error of the call that writes. To be called again after a library has set handlers of its own.
/// Not collective.
/// @param rank of this process: only the first one prints the line, if all get the signal
void catch_stop_signals(int rank);

/// From here on these signals end the process as the system does, without a line: the run is over and has said so, and
/// mpirun sends SIGTERM to the remaining ranks a moment after one has failed. Not collective.
void release_stop_signals();

/// From here on the first of these signals is only noted, and stop_signal tells of it; a second one ends the process at
/// once, unless both are SIGXCPU, which comes every second. SIGCONT is noted, too, and asks for a checkpoint: Open
/// MPI's mpirun sends it to its ranks some time before it ends them. Signals noted before are forgotten. Not
/// collective.
void defer_stop_signals();

/// The signal that has been noted on any rank of the communicator, SIGCONT only if there is no other, and only once; 0
/// if there is none. Collective.
int stop_signal(MPI_Comm comm);

/// Does work that the ranks of the communicator do together, which leaves off at its next StopPoint once a signal has
/// been noted on one of them. Collective. @param heeds_sigcont whether at SIGCONT, too
/// @returns the signal at which it was left, the same on all ranks; 0: it is done
int until_stopped(MPI_Comm comm, const std::function<void()>& work, bool heeds_sigcont = false);

/// A place that all ranks pass again and again while they work together, such as an iteration of a linear solver. Now
/// and then they ask each other there for signals: after so many passes that about a tenth of a second lies between,
/// by the clock of the slowest rank, but after 64 at most; as all ranks know this number, they ask together, and leave
/// the work in the same pass. Outside of until_stopped a pass does nothing. It belongs to the ranks that pass it: the
/// works in which they do so are all of one communicator.
class StopPoint {
 public:
  /// Collective on the communicator of until_stopped. @returns whether the work is to be left, the same on all its
  /// ranks
  bool pass();

 private:
  int passes_ = 1;   ///< from one question to the next
  int left_ = 1;     ///< of them
  double last_ = 0;  ///< when the ranks last asked [s]
};

/// Leaves the work of until_stopped, which catches it; a callback of PETSc's must not let it through.
class Stopped {};

/// @throws Stopped if a StopPoint has said that the work is to be left. Not collective.
void leave_if_stopped();

/// "SIGTERM"
std::string signal_name(int signal);

}  // namespace base
}  // namespace pellicle
