#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/stage_clock.h"
#include "io/history.h"
#include "simulation/burn.h"

namespace pellicle {

/// The books of a run: a row of history.csv for the initial state and for each step, and with `project.monitor` the
/// curves of Fig. 8 in projection.csv.
class Ledger {
 public:
  /// Makes the files. Collective. @throws Error when they cannot be written
  Ledger(const Sheet& sheet, const Options& options, const StageClock& clock);

  /// @param h length of the step [s]
  /// @param retries how often it was tried again. Collective.
  void add(const State& state, const BurnStep& step, double h, int retries);

  /// Collective.
  void add(double time, int step, const std::vector<ProjectionError>& errors);

 private:
  const Sheet& sheet_;
  const Options& options_;
  const StageClock& clock_;
  std::unique_ptr<History> history_;
  std::unique_ptr<History> projection_;
};

/// (d - l)/l of the owned and ghost springs of a colour, d the present and l the target length.
std::vector<double> strains(const SpringSet& springs, const State& state, Colour colour);

}  // namespace pellicle
