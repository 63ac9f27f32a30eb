#pragma once

namespace pellicle {

/// What this thread has asked for since it began.
struct Requests {
  long own = 0;             ///< of memory: by operator new, or by what is compiled into this program, such as Eigen
  long foreign = 0;         ///< of memory: by shared libraries without operator new, PETSc, MPI, C
  long objects = 0;         ///< of PETSc, made anew: also what comes with symbolic work
  long option_lookups = 0;  ///< in PETSc's options, but for those that KSPSolve and MatAssemblyEnd always have
};

Requests requests();

inline Requests operator-(const Requests& after, const Requests& before) {
  return {after.own - before.own, after.foreign - before.foreign, after.objects - before.objects,
          after.option_lookups - before.option_lookups};
}

}  // namespace pellicle
