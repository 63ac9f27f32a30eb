#pragma once

#include <petscksp.h>

#include <functional>
#include <string>

#include "base/namespaces.h"

namespace pellicle::linear {

/// A preconditioner for one particular matrix, as a PETSc type: after `offer_preconditioner(matrix, "lines", ...)`,
/// `-<prefix>pc_type lines` sets it on any solver that is preconditioned from that matrix.
struct OwnPreconditioner {
  std::function<void()> update;                ///< called once before solves with new values; may be empty
  std::function<void(Vec in, Vec out)> apply;  ///< symmetric positive definite
  std::string words;                           ///< for `-<prefix>ksp_view`
};

/// Registers a matrix's preconditioner, and its type with PETSc. Collective. @param offered must outlive the solvers
void offer_preconditioner(Mat matrix, const std::string& type, const OwnPreconditioner& offered);

/// Whether any matrix has a preconditioner of this type.
bool is_own_type(const std::string& type);
/// Whether a given matrix has a preconditioner of this type.
bool offers_preconditioner(Mat matrix, const std::string& type);

}  // namespace pellicle::linear
