#pragma once

#include <petscksp.h>

#include <Eigen/Core>
#include <array>
#include <vector>

#include "base/handle.h"
#include "energies/tangent.h"
#include "linear/substructures.h"
#include "parallel/field.h"

namespace pellicle::energies {

/// The coarse level of a two-level preconditioner (PCMG) for the tangent of a wall or a sheet.
///
/// METIS groups the vertices of each rank into patches, and each patch moves as a rigid body, from its present shape.
/// The wall resists such motions only where patches meet, which is why point-wise preconditioners hardly reduce them;
/// with the coarse level the number of iterations depends on the size of the patches and not on that of the mesh. The
/// preconditioner is the sum of two levels: the inverse 3x3 blocks of the diagonal, and the coarse level, solved
/// exactly.
class RigidPatches {
 public:
  /// Sets the levels of the solver's PCMG, before the user's options for them (`mg_levels_`, `mg_coarse_`) are read.
  /// Collective.
  /// @param solver whose preconditioner is PCMG @param tangent whose matrix it is made from; both must outlive the
  /// patches
  /// @param triangles local vertices of each triangle, whose edges join vertices
  /// @param patch_size approximate number of vertices of a patch
  /// @throws Error if the tangent is SBAIJ
  RigidPatches(KSP solver, const Tangent& tangent, const std::vector<std::array<PetscInt, 3>>& triangles,
               int patch_size);
  RigidPatches(const RigidPatches&) = delete;  // PETSc's interpolation points to this object.
  RigidPatches& operator=(const RigidPatches&) = delete;

  /// Computes the coarse level from the tangent's present values, which must be positive definite. Collective.
  /// @param x positions at which the tangent was updated [m]
  void refresh(const Field& x);

  /// Lets the coarse level be made anew. Must be called when the tangent has a new pattern. Collective.
  void forget_pattern();

 private:
  using Motion = Eigen::Matrix<double, 3, 6>;
  using CoarseBlock = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  using Gram = Eigen::Matrix<double, 6, 6>;
  using Movement = Eigen::Matrix<double, 6, 1>;  ///< shift and turn of a body, or force and moment on it
  /// Sum of numbers that couple vertices of two patches in all directions alike, times (1, arm) of both vertices.
  using Moments = Eigen::Matrix4d;
  /// The coupling of two patches: a block of the coarse matrix.
  struct Coupling {
    CoarseBlock block = CoarseBlock::Zero();
    Moments moments = Moments::Zero();  ///< to be added to the block
  };
  /// A patch's row of the coarse matrix, in order of insertion.
  struct CoarseRow {
    std::vector<PetscInt> columns;  ///< global patches
    std::vector<Coupling> couplings;
  };

  void set_levels(PC pc);
  void number_reach();
  void find_motions(const Field& x);
  Motion of_body(PetscInt vertex) const;
  class Sum;
  Coupling& coupling(PetscInt row, PetscInt column);
  void fill_coarse();
  void interpolate(Vec patches, Vec vertices) const;
  void restrict_to_patches(Vec vertices, Vec patches) const;
  Motion motion(PetscInt vertex) const { return motions_.values().col(vertex).reshaped(3, 6); }
  PetscInt local_patch(PetscInt vertex) const { return patch_[vertex] - first_patch_; }
  PetscInt own_patches() const { return static_cast<PetscInt>(rows_.size()); }
  bool is_own(PetscInt patch) const { return patch >= first_patch_ && patch < first_patch_ + own_patches(); }
  CoarseRow& row(PetscInt patch) { return rows_[patch - first_patch_]; }
  const Eigen::Matrix3d& projector(PetscInt vertex) const { return tangent_.projectors()[vertex]; }
  bool is_bound(PetscInt vertex) const { return !tangent_.projectors().is_free(vertex); }
  const Gram& basis_of(PetscInt patch) const { return basis_[patch - first_patch_]; }

  const Tangent& tangent_;
  std::vector<PetscInt> patch_;  ///< global patch of each owned vertex, then of the others in reach
  PetscInt first_patch_ = 0;     ///< global number of this rank's first patch
  bool has_neighbours_ = false;  ///< whether any rank has vertices of others in reach
  Field motions_;                ///< (3 x 6, by columns) of each vertex in reach, if there are neighbours
  std::vector<CoarseRow> rows_;  ///< of this rank's patches
  // Data of this rank's patches, from the last find_motions.
  Eigen::Matrix3Xd centre_;  ///< [m]
  Eigen::VectorXd count_;    ///< number of vertices
  Eigen::VectorXd radius_;   ///< so that turns and shifts are of like size [m]
  Eigen::Matrix3Xd arm_;     ///< from the patch's centre to each owned vertex, over its radius
  /// Coordinates, as shifts and turns, of an orthonormal basis of the motions; columns beyond their rank are 0.
  std::vector<Gram> basis_;
  mutable Eigen::Matrix<double, 6, Eigen::Dynamic> movement_;  ///< scratch of interpolate and restrict_to_patches
  bool is_whole_ = false;                                      ///< whether the coarse matrix has all blocks of the rows
  MatHandle interpolation_;                                    ///< shell, (3 vertices x 6 patches)
  MatHandle coarse_;                                           ///< interpolation^T tangent interpolation
  KSP coarse_solver_ = nullptr;
  Substructures substructures_;  ///< of the coarse matrix, where ranks share it
};

}  // namespace pellicle::energies
