#pragma once

#include <petscsys.h>

#include "base/error.h"

namespace pellicle::base {

/// A line of `-log_view`, made by the first call with this name; for a static variable.
inline PetscLogEvent log_event(const char* name) {
  PetscLogEvent event = -1;
  check(PetscLogEventRegister(name, PETSC_OBJECT_CLASSID, &event));
  return event;
}

/// Logs a scope under the line of an event. Not collective.
class LogScope {
 public:
  /// @param flops of the scope: each sum, product, quotient, root or other function counts as one
  LogScope(PetscLogEvent event, double flops) : event_(event) {
    check(PetscLogEventBegin(event_, nullptr, nullptr, nullptr, nullptr));
    check(PetscLogFlops(flops));
  }
  LogScope(const LogScope&) = delete;
  LogScope& operator=(const LogScope&) = delete;
  ~LogScope() { PetscLogEventEnd(event_, nullptr, nullptr, nullptr, nullptr); }

 private:
  PetscLogEvent event_;
};

}  // namespace pellicle::base
