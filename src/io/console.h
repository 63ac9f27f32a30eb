#pragma once

#include <mpi.h>

#include <iosfwd>
#include <iostream>
#include <string>

namespace pellicle {

class StageClock;

/// What a progress line tells of a step.
struct Progress {
  int step = 0;
  double time = 0;      ///< [s]
  double share = 0;     ///< of the run that is done, 0 to 1
  int iterations = 0;   ///< linear iterations of the step
  std::string figures;  ///< of the chain, such as "|C| 1.2e-05 m"
};

/// Whether a person sees what this process prints. `mpirun` gives its ranks a terminal of its own making whatever its
/// own output is, so under it mpirun's output is what counts.
bool stdout_is_terminal();

/// What a run tells while it goes on; rank 0 prints. Silent unless the output is a terminal or progress lines are asked
/// for (`-output_monitor N`).
class Console {
 public:
  /// @param monitor a progress line every so many steps; 0: every step on a terminal, none elsewhere
  Console(MPI_Comm comm, int monitor, std::ostream& stream = std::cout, bool terminal = stdout_is_terminal());

  /// Prints a line of the header or a remark.
  void say(const std::string& line);
  /// Prints why a run ended before its time, also where progress is not printed.
  void conclude(const std::string& line);
  /// Prints the progress line of a step, if it is due; the time left follows from the time since the console was made.
  void progress(const Progress& progress);
  /// Prints the table of time per stage: of each stage the slowest rank's. Collective.
  void stage_table(const StageClock& clock);

 private:
  MPI_Comm comm_;
  bool is_root_;
  int interval_;  ///< steps between progress lines; 0: nothing is printed
  std::ostream& stream_;
  double start_;
};

/// A span of time as people say it: "0.35 s", "12 s", "3 min 05 s", "2 h 10 min".
std::string duration_text(double seconds);

}  // namespace pellicle
