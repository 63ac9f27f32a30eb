#pragma once

#include <mpi.h>

#include <functional>
#include <string>

#include "base/error.h"

namespace pellicle::base {

/// A signal has ended the run, and its state has been saved. `main` exits with 128 + the signal, as shells expect.
class Interrupted : public Error {
 public:
  Interrupted(int signal, const std::string& message) : Error(message), signal_(signal) {}
  int signal() const { return signal_; }

 private:
  int signal_;
};

/// Makes SIGTERM, SIGINT, SIGHUP, SIGUSR1, SIGUSR2 and SIGXCPU, by which people and batch systems end a run, end this
/// process at once, with a line on standard error and the exit code 128 + the signal. SIGHUP stays ignored under nohup.
/// SIGPIPE and SIGXFSZ are ignored: writing into a pipe without a reader, or beyond the limit of file size, then is an
/// error of the writing call. To be called again after a library has set handlers of its own. Not collective.
/// @param rank of this process: if all get the signal, rank 0 alone prints the line
void catch_stop_signals(int rank);

/// Restores the system's actions on these signals, without a line, at the end of a run: mpirun sends SIGTERM to the
/// remaining ranks a moment after one has failed. Not collective.
void release_stop_signals();

/// Makes the first of these signals only be noted, for stop_signal; a second one ends the process at once, unless both
/// are SIGXCPU, which comes every second. SIGCONT is noted, too, as a request for a checkpoint: Open MPI's mpirun sends
/// it to its ranks some time before it ends them. Clears signals noted before. Not collective.
void defer_stop_signals();

/// The signal that has been noted on any rank of the communicator, SIGCONT only if there is no other, and only once; 0
/// if there is none. Collective.
int stop_signal(MPI_Comm comm);

/// Runs collective work of the ranks of a communicator, which is left at its next StopPoint after a signal has been
/// noted on one of them. Collective. @param heeds_sigcont whether SIGCONT also stops it
/// @returns the signal at which the work was left, the same on all ranks; 0: it is complete
int until_stopped(MPI_Comm comm, const std::function<void()>& work, bool heeds_sigcont = false);

/// A place that all ranks pass repeatedly in collective work, such as an iteration of a linear solver, and where they
/// exchange noted signals about every tenth of a second, by the clock of the slowest rank, but at least every 64
/// passes. All ranks know the number of passes in between, so that they exchange, and leave the work, in the same pass.
/// Outside of until_stopped a pass does nothing. All works in which the same ranks pass it have one communicator.
class StopPoint {
 public:
  /// Collective on the communicator of until_stopped. @returns whether the work is to be left, the same on all its
  /// ranks
  bool pass();

 private:
  int passes_ = 1;   ///< number from one exchange to the next
  int left_ = 1;     ///< passes left until the next exchange
  double last_ = 0;  ///< time of the last exchange [s]
};

/// Thrown to leave the work of until_stopped, which catches it; must not pass through a PETSc callback.
class Stopped {};

/// @throws Stopped if a StopPoint has decided to leave the work. Not collective.
void leave_if_stopped();

/// "SIGTERM"
std::string signal_name(int signal);

}  // namespace pellicle::base
