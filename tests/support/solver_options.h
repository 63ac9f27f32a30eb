#pragma once

#include <petscsys.h>

#include <string>
#include <utility>
#include <vector>

#include "base/error.h"

namespace pellicle {

/// Options in PETSc's database while it lives; all that were added meanwhile go with it, those of solvers too.
class SolverOptions {
 public:
  SolverOptions() : options_(make()) { check(PetscOptionsPush(options_)); }
  SolverOptions(const SolverOptions&) = delete;
  SolverOptions& operator=(const SolverOptions&) = delete;
  ~SolverOptions() {
    PetscOptionsPop();
    PetscOptionsDestroy(&options_);
  }

  /// @param name without the dash
  void set(const std::string& name, const std::string& value) {
    check(PetscOptionsSetValue(nullptr, ("-" + name).c_str(), value.c_str()));
  }

 private:
  static PetscOptions make() {
    PetscOptions options = nullptr;
    check(PetscOptionsCreate(&options));
    return options;
  }

  PetscOptions options_ = nullptr;
};

/// A preconditioner, or a direct solver, as options without their prefix.
struct SolverChoice {
  std::string name;
  std::vector<std::pair<std::string, std::string>> options;
  bool one_rank_only = false;
};

/// The preconditioners of the solver experiments.
inline std::vector<SolverChoice> solver_choices() {
  std::vector<SolverChoice> choices;
  for (const char* type : {"none", "jacobi", "icc", "bjacobi", "asm", "gamg", "hypre"}) {
    choices.push_back({type, {{"pc_type", type}}});
  }
  choices.push_back({"mumps", {{"pc_type", "cholesky"}, {"pc_factor_mat_solver_type", "mumps"}}});
  choices.push_back({"cholmod", {{"pc_type", "cholesky"}, {"pc_factor_mat_solver_type", "cholmod"}}, true});
  return choices;
}

inline int ranks() {
  int count = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &count);
  return count;
}

inline int this_rank() {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  return rank;
}

}  // namespace pellicle
