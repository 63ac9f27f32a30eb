#pragma once

#include <vector>

#include "elastic/bending_stencils.h"
#include "solvers/potential.h"

namespace pellicle {
inline namespace elastic {

/// Bending energy of a sheet, U = sum over the stencils of A (D_1 b_11^2 + 2 sqrt(D_1 D_2) b_12^2 + D_2 b_22^2) / 2
/// with b = B - B*, B the curvature that BendingStencils measures and B* the one without moment. Where a sheet bends
/// without stretching one of the principal curvatures is nearly 0, and Poisson's ratio plays no part beyond that in D.
/// Nothing here communicates.
///
/// Both curvatures, exact and positive, are the Hessian without the change of the normals: positive semi-definite, and
/// exact where the sheet is at rest.
class BendingPotential : public Potential {
 public:
  /// The sheet must outlive it.
  BendingPotential(const Sheet& sheet, const Weave& weave, const std::vector<bool>& clamped);

  /// What the sheet is like without moments; the owned part of the particles and the ghosts that stencils reach.
  struct Input {
    const std::vector<double>& shrinkage;  ///< length over undeformed length of each local particle
    double layer_distance = 0;             ///< over which corners and lattice points shrink apart; 0: no curl [m]
    std::array<double, 2> stiffness{};     ///< along warp and weft [N m]
    const std::vector<double>& factor;     ///< on it, of each local particle
    double damping_over_step = 0;          ///< viscosity over stiffness and length of the step
  };

  /// Sets B* and the stiffness of a step that starts at `start`. Not collective.
  void begin_step(const Living& living, const Field& start, const Input& input);

  double value(const Field& x) const override;
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  void update_hessian(const Field& x, Curvature curvature) override;
  void add_hessian(const HessianBlocks& blocks) const override;
  bool multiplies() const override { return true; }
  void add_product(const double* w, double* result) const override;

  const BendingStencils& stencils() const { return stencils_; }

 private:
  using Curvature3 = BendingStencils::Curvature3;
  using Stencil = BendingStencils::Stencil;
  using Positions = Eigen::Map<const Eigen::Matrix3Xd>;

  /// A stencil at some positions.
  struct Bent {
    Eigen::Matrix3d arms;  ///< sum_i w_ki x_i by columns: B without the normal
    Eigen::Vector3d normal;
    double doubled_area = 0;  ///< of the area vector
    Curvature3 excess;        ///< B - B*
  };
  Bent bend(std::size_t stencil, const Positions& x) const;

  const Sheet* sheet_;
  BendingStencils stencils_;
  std::vector<Curvature3> target_;     ///< B* of each stencil
  std::vector<Curvature3> stiffness_;  ///< area times stiffness of b_11, b_12, b_22; 0: not used [N m^3]
  Eigen::Matrix3Xd normal_;            ///< of the Hessian
};

}  // namespace elastic
}  // namespace pellicle
