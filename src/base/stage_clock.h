#pragma once

#include <string>
#include <vector>

#include "base/error.h"

namespace pellicle::base {

/// Cost of one stage of a step so far.
struct StageTime {
  std::string name;
  int calls = 0;
  double seconds = 0;      ///< wall time, all calls
  double lap_seconds = 0;  ///< wall time since StageClock::start_lap
  PetscLogStage logged = -1;
};

/// Wall time of each stage of a simulation. Every stage is also a PETSc log stage, so that `-log_view` has a line and
/// a table of events a stage. Stages do not nest.
class StageClock {
 public:
  /// @param names of the stages in the order of the tables, the same on all ranks. PETSc must be initialised.
  explicit StageClock(const std::vector<std::string>& names);

  /// Times a stage from here to the end of its scope.
  class Timer {
   public:
    explicit Timer(StageTime& stage) : stage_(stage), start_(MPI_Wtime()) { check(PetscLogStagePush(stage.logged)); }
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;
    ~Timer();

   private:
    StageTime& stage_;
    double start_;
  };

  /// `const auto timer = clock.time("heat");` @throws std::logic_error if the stage was not declared.
  [[nodiscard]] Timer time(const std::string& name);

  /// Sets every stage's lap_seconds to 0, at the beginning of a step.
  void start_lap();

  /// This rank's times, in the order of the constructor.
  const std::vector<StageTime>& stages() const { return stages_; }
  /// Wall time since the clock was made [s].
  double elapsed() const { return MPI_Wtime() - start_; }

 private:
  std::vector<StageTime> stages_;
  double start_;
};

}  // namespace pellicle::base
