#pragma once

#include <petscksp.h>

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "base/handle.h"
#include "parallel/layout.h"
#include "solvers/preconditioner_lag.h"

namespace pellicle {
inline namespace solvers {

/// Vertices and what joins them, as far as the patches need to know; all must outlive the call that has it.
struct PatchedNet {
  const Layout& vertices;
  const Eigen::Matrix3Xd& rest;                           ///< of the local ones [m]
  const std::vector<std::array<PetscInt, 3>>& triangles;  ///< local vertices of each
  const std::vector<Eigen::Matrix3d>& projectors;         ///< on the directions in which each local vertex may move
};

/// The coarse level of a two-level preconditioner (PCMG) for the tangent of a wall or a sheet.
///
/// METIS gathers the vertices of each rank in patches, and each patch moves as a rigid body. The wall resists such
/// motions only where patches meet, which is why point-wise preconditioners hardly see them; with the coarse level the
/// number of iterations depends on the size of the patches and not on that of the mesh. The levels are added: the 3x3
/// blocks of the diagonal and, exactly, the coarse level.
class RigidPatches {
 public:
  /// Gives the solver's PCMG its levels, before the user's options for them (`mg_levels_`, `mg_coarse_`) are read.
  /// Collective.
  /// @param patch_size about so many vertices a patch
  /// @returns none if the solver has another preconditioner. Solver and tangent must outlive the patches.
  /// @throws Error unless the tangent is BAIJ or AIJ
  static std::optional<RigidPatches> of(KSP solver, Mat tangent, const PatchedNet& net, int patch_size);

  /// Whether solves with the present coarse level have taken so many more iterations than the shortest of them that a
  /// new one would have been cheaper, or there is none yet. To be asked once after each solve.
  bool due() { return lag_.due(solver_); }

  /// Takes the tangent's present values, which must be positive definite, over to the coarse level. Collective.
  void renew();

  /// To be called when the tangent has another pattern, before it has values: the coarse level is due.
  void forget_pattern();

 private:
  KSP solver_ = nullptr;
  Mat tangent_ = nullptr;
  MatHandle rows_;           ///< the tangent as AIJ, where it is not
  MatHandle interpolation_;  ///< (3 vertices x at most 6 patches)
  MatHandle coarse_;         ///< interpolation^T tangent interpolation
  KSP coarse_solver_ = nullptr;
  PreconditionerLag lag_;
};

}  // namespace solvers
}  // namespace pellicle
