#pragma once

#include <mpi.h>

#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "base/stage_clock.h"

namespace pellicle::io {

/// The figures of a progress line.
struct Progress {
  int step = 0;
  double time = 0;      ///< [s]
  double fraction = 0;  ///< completed part of the run, 0 to 1
  int iterations = 0;   ///< linear iterations of the step
  std::string figures;  ///< further figures of the chain, such as "|C| 1.2e-05 m"
};

/// Whether the output of this process goes to a terminal. Under mpirun, whose ranks always have a terminal of their
/// own, the output of mpirun itself is examined.
bool stdout_is_terminal();

/// Prints the messages of a run, on rank 0. If the output is no terminal and progress lines are not requested
/// (`-output_monitor N`), the run counts as unwatched: then only the lines of `tell`, which a log needs, and a progress
/// line from time to time are printed.
class Console {
 public:
  /// @param monitor a progress line every so many steps; 0: every step on a terminal, none elsewhere
  /// @param longest_silence time without a line after which the next step has a progress line, even if unwatched [s]
  Console(MPI_Comm comm, int monitor, std::ostream& stream = std::cout, bool terminal = stdout_is_terminal(),
          double longest_silence = 300);

  /// Prints a line that an unwatched run leaves out: a line of the header, a table.
  void say(const std::string& line);
  /// Prints a line that every run's log needs: about the mesh, a warning, a failed step, the end of the run.
  void tell(const std::string& line);
  void tell(const std::vector<std::string>& lines);  ///< several such lines
  /// Prints the progress line of a step, if it is due; the time left follows from the time since the console was made.
  void progress(const Progress& progress);
  /// Prints the table of time per stage: for each stage the time of the slowest rank. Collective.
  /// @param clocks not empty, by the names of the objects whose stages they time; the name of a single one may be empty
  void stage_table(const std::vector<std::pair<std::string, const StageClock*>>& clocks);

  MPI_Comm comm() const { return comm_; }  ///< of the ranks of the run

 private:
  MPI_Comm comm_;
  int rank_;
  int interval_;  ///< steps between progress lines; 0: unwatched
  std::ostream& stream_;
  double longest_silence_;  ///< [s]
  double start_;
  double last_line_;  ///< time of the last printed line
};

/// A time of a run [s] in six digits: "0.125 s".
std::string time_text(double seconds);

/// A span of time in words: "0.35 s", "12 s", "3 min 05 s", "2 h 10 min".
std::string duration_text(double seconds);

}  // namespace pellicle::io
