#pragma once

#include <petscksp.h>

#include <functional>
#include <string>

namespace pellicle {
inline namespace solvers {

/// A preconditioner that only the maker of a matrix has, as a type of PETSc's: after `offer_preconditioner(matrix,
/// "lines", ...)`, `-<prefix>pc_type lines` sets it on any solver whose preconditioner is made from that matrix.
struct OwnPreconditioner {
  std::function<void()> update;                ///< called once before solves with new values; may be empty
  std::function<void(Vec in, Vec out)> apply;  ///< symmetric positive definite
  std::string words;                           ///< for `-<prefix>ksp_view`
};

/// Registers the type with PETSc the first time. @param offered must outlive the solvers. Collective.
void offer_preconditioner(Mat matrix, const std::string& type, const OwnPreconditioner& offered);

/// Whether some matrix has offered a preconditioner of this type.
bool is_own_type(const std::string& type);
/// Whether this matrix has.
bool offers_preconditioner(Mat matrix, const std::string& type);

}  // namespace solvers
}  // namespace pellicle
