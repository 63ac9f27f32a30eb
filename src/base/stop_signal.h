#pragma once

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

/// From here on SIGTERM, SIGINT, SIGHUP, SIGUSR1 and SIGUSR2, by which people and batch systems end a run, end this
/// process at once, with a line on standard error and the exit code 128 + the signal. SIGHUP stays ignored under nohup.
/// To be called again after a library has set handlers of its own. Not collective.
/// @param rank of this process: only the first one prints the line, if all get the signal
void catch_stop_signals(int rank);

/// From here on these signals end the process as the system does, without a line: the run is over and has said so, and
/// mpirun sends SIGTERM to the remaining ranks a moment after one has failed. Not collective.
void release_stop_signals();

/// From here on the first of these signals is only noted, and stop_signal tells of it; a second one ends the process at
/// once. A signal noted before is forgotten. Not collective.
void defer_stop_signals();

/// The signal that has been noted on any rank, 0 if there is none. Collective on MPI_COMM_WORLD.
int stop_signal();

/// "SIGTERM"
std::string signal_name(int signal);

}  // namespace base
}  // namespace pellicle
