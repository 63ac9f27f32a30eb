#pragma once

#include <string>
#include <vector>

#include "options/choice.h"

namespace pellicle::io {

/// Folder, content and frequency of a run's files.
struct OutputOptions {
  std::string directory;            ///< empty: output/<name>; see name_after
  std::string name;                 ///< of the .pvd and the first part of each frame's name
  double interval_time = 0;         ///< [s]; 0: frames by steps
  int interval_steps = 1;           ///< used when interval_time is 0
  std::vector<std::string> fields;  ///< particle fields to draw; empty: all
  bool springs = false;             ///< also write the springs as lines
  int monitor = 0;  ///< a progress line every so many steps; 0: every step on a terminal, none elsewhere

  /// Sets name and directory from the deck's file name, if they are empty: `input/roof.yaml` is named `roof` and goes
  /// to `output/roof`.
  void name_after(const std::string& deck);
  /// @throws Error if the name cannot be part of a file name, or the directory has control characters.
  void validate() const;
};

void describe(OptionTable& table, OutputOptions& options);

}  // namespace pellicle::io
