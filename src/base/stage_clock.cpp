#include "base/stage_clock.h"

#include <mpi.h>

#include <stdexcept>

#include "base/error.h"

namespace pellicle {

namespace {

PetscLogEvent event_named(const std::string& name) {
  PetscLogEvent event = -1;
  check(PetscLogEventGetId(name.c_str(), &event));
  if (event < 0) {
    PetscClassId class_id = 0;
    check(PetscClassIdRegister("pellicle", &class_id));
    check(PetscLogEventRegister(name.c_str(), class_id, &event));
  }
  return event;
}

}  // namespace

StageClock::StageClock(const std::vector<std::string>& names) : start_(MPI_Wtime()) {
  for (const std::string& name : names) {
    StageTime stage;
    stage.name = name;
    stages_.push_back(stage);
    events_.push_back(event_named(name));
  }
}

StageClock::Timer::Timer(StageTime& stage, PetscLogEvent event) : stage_(stage), event_(event), start_(MPI_Wtime()) {
  check(PetscLogEventBegin(event_, 0, 0, 0, 0));
}

StageClock::Timer::~Timer() {
  PetscLogEventEnd(event_, 0, 0, 0, 0);
  const double seconds = MPI_Wtime() - start_;
  stage_.seconds += seconds;
  stage_.lap_seconds += seconds;
  ++stage_.calls;
}

StageClock::Timer StageClock::time(const std::string& name) {
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    if (stages_[i].name == name) {
      return Timer(stages_[i], events_[i]);
    }
  }
  throw std::logic_error("StageClock has no stage " + name);
}

void StageClock::start_lap() {
  for (StageTime& stage : stages_) {
    stage.lap_seconds = 0;
  }
}

double StageClock::elapsed() const { return MPI_Wtime() - start_; }

}  // namespace pellicle
