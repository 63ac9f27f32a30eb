#pragma once

#include <petscksp.h>

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/handle.h"
#include "mesh/membrane.h"

namespace pellicle {

/// The coarse level of a two-level multigrid preconditioner (PCMG) for the wall of a balloon.
///
/// METIS gathers the vertices of each rank in patches, and each patch moves as a rigid body. The wall resists such
/// motions only where patches meet, which is why point-wise smoothers hardly reduce them; with them taken out, the
/// number of iterations depends on the size of the patches and not on that of the mesh.
class RigidPatches {
 public:
  /// Gives the solver's PCMG its coarse level and its smoother, Chebyshev with the 3x3 blocks of the diagonal, before
  /// the user's options for the levels (`mg_levels_`, `mg_coarse_`) are read. Collective.
  /// @param projectors on the directions in which each local vertex may move
  /// @param patch_size about so many vertices a patch
  /// @returns none if the solver has another preconditioner. The tangent must outlive the patches.
  /// @throws Error unless the tangent is BAIJ or AIJ
  static std::optional<RigidPatches> of(KSP solver, Mat tangent, const Membrane& membrane,
                                        const std::vector<Eigen::Matrix3d>& projectors, int patch_size);

  /// Takes the tangent's new values over to the coarse level. Collective.
  void update();

 private:
  Mat tangent_ = nullptr;
  MatHandle rows_;           ///< the tangent as AIJ, where it is not
  MatHandle interpolation_;  ///< (3 vertices x 6 patches)
  MatHandle coarse_;         ///< interpolation^T tangent interpolation
  KSP coarse_solver_ = nullptr;
};

}  // namespace pellicle
