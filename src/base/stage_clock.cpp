#include "base/stage_clock.h"

#include <stdexcept>

#include "base/sorting.h"

namespace pellicle::base {

StageClock::StageClock(const std::vector<std::string>& names) : start_(MPI_Wtime()) {
  for (const std::string& name : names) {
    PetscLogStage& logged = stages_.emplace_back(StageTime{name}).logged;
    check(PetscLogStageGetId(name.c_str(), &logged));
    if (logged < 0) {
      check(PetscLogStageRegister(name.c_str(), &logged));
    }
  }
}

StageClock::Timer::~Timer() {
  PetscLogStagePop();
  const double seconds = MPI_Wtime() - start_;
  stage_.seconds += seconds;
  stage_.lap_seconds += seconds;
  ++stage_.calls;
}

StageClock::Timer StageClock::time(const std::string& name) {
  StageTime* stage = first_that(stages_, [&name](const StageTime& other) { return other.name == name; });
  if (stage == nullptr) {
    throw std::logic_error("StageClock has no stage " + name);
  }
  return Timer(*stage);
}

void StageClock::start_lap() {
  for (StageTime& stage : stages_) {
    stage.lap_seconds = 0;
  }
}

}  // namespace pellicle::base
