#pragma once

#include <vector>

#include "elastic/bending_stencils.h"
#include "energies/potential.h"

namespace pellicle::elastic {

/// Bending energy of a sheet,
///
///     U = sum over the stencils of A (D_1 |r_11|^2 + 2 sqrt(D_1 D_2) |r_12|^2 + D_2 |r_22|^2) / 2,  r = B - B* n,
///
/// with the second derivatives B of the positions that BendingStencils measures, the normal n, and the curvature B*
/// without moment. A sheet that bends without stretching has B along n, and r is its curvature less B*; where B* is 0
/// the energy is quadratic in the positions and needs no normal, which a sharp fold lacks (Bergou and others, A
/// quadratic bending model for inextensible surfaces, 2006). One of the principal curvatures is then nearly 0, and
/// Poisson's ratio enters by D alone. At a clamp the normal is fixed, and r is the part along it.
///
/// Viscosity resists the change of B along the normal that the sheet had at the step's start,
/// U = D (tau/h) |n . (B - B_start)|^2 / 2: neither a rotation of the sheet as a whole, nor B in the tangent plane,
/// which strain changes, too.
///
/// Both curvatures, the exact and the positive one, are the Hessian without the change of the normals: positive
/// semi-definite, and exact where B* or r is 0. For viscosity it uses normals of particles, not of stencils, so that a
/// number for each pair of particles and a normal for each particle suffice; it is exact where the sheet is flat. In
/// sharp folds weak viscosity is in the Hessian in all directions.
class BendingPotential : public Potential {
 public:
  /// The sheet must outlive this object. @param warp, clamped as for BendingStencils
  BendingPotential(const Sheet& sheet, const Eigen::Vector3d& warp, const std::vector<bool>& clamped);

  /// Shrinkage and stiffness in a step, for the owned particles and the ghosts that stencils reach.
  struct Input {
    const std::vector<double>& shrinkage;  ///< length over undeformed length of each local particle
    double layer_distance = 0;             ///< between the layers of corners and lattice points; 0: no curl [m]
    std::array<double, 2> stiffness{};     ///< along warp and weft [N m]
    const std::vector<double>& factor;     ///< on the stiffness, of each local particle
    double damping_over_step = 0;          ///< viscosity over stiffness and length of the step
  };

  /// Sets B* and the stiffness of a step that starts at `start`. Collective.
  void begin_step(const ActiveSet& active, const Field& start, const Input& input);

  double value(const Field& x) const override;
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override { add_value_and_gradient(x, gradient); }
  double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  void update_hessian(const Field& x, double psd_blend) override;
  void add_hessian(const HessianBlocks& blocks) const override;
  bool has_terms() const override { return true; }
  void visit(HessianTerms& terms) const override;

  const BendingStencils& stencils() const { return stencils_; }

  /// This rank's fraction of the viscous term in the value, half of the work against viscosity [J].
  double viscous_energy(const Field& x) const;

 private:
  using Curvature3 = BendingStencils::Curvature3;
  using Stencil = BendingStencils::Stencil;

  /// The normal at a stencil, shorter than 1 in a sharp fold, with the length by which the area vector was divided.
  struct Normal {
    Eigen::Vector3d direction;
    double length = 1;  ///< of the area vector, bounded away from 0 [m^2]
  };
  Normal normal_at(std::size_t stencil, const Field& x) const;
  /// Energy of a stencil. @param bent, residual from `second_derivatives` and `residual`
  double energy(std::size_t stencil, const Eigen::Matrix3d& bent, const Eigen::Matrix3d& residual) const;
  /// B by columns.
  Eigen::Matrix3d second_derivatives(const Stencil& stencil, const Field& x) const;
  /// r by columns. @param second_derivatives at x @param normal set if needs_normal
  Eigen::Matrix3d residual(std::size_t stencil, const Eigen::Matrix3d& second_derivatives, const Field& x,
                           Normal& normal) const;
  bool needs_normal(std::size_t stencil) const {
    return stencils_.stencils()[stencil].is_clamped || !target_[stencil].isZero(0);
  }
  /// Calls `take` with both particles and the block, for all blocks of clamped stencils.
  template <class Take>
  void visit_clamped(const Take& take) const;
  bool is_damped() const { return damping_ > 0; }
  bool find_normals();

  const Sheet* sheet_;
  BendingStencils stencils_;
  std::vector<Curvature3> target_;     ///< B* of each stencil
  std::vector<Curvature3> stiffness_;  ///< area times stiffness of r_11, r_12, r_22; 0: not used [N m^3]
  std::vector<double> reference_;      ///< length of each stencil's undeformed area vector [m^2]
  /// Viscosity of a stencil in a step.
  struct Dashpot {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Curvature3 start = Curvature3::Zero();  ///< n . B at the start of the step [1/m]
    /// n . (B - B_start)
    Curvature3 change(const Eigen::Matrix3d& second_derivatives) const {
      return (second_derivatives.transpose() * normal).array() - start;
    }
  };
  std::vector<Dashpot> dashpots_;
  double damping_ = 0;                  ///< viscosity over stiffness and length of the step
  std::vector<int> number_of_normals_;  ///< of the dashpots round each owned particle

  // The Hessian of the stencils that are not clamped; `along` is the fraction of viscosity, or 0.
  NumberRows rows_;
  struct Use {
    PetscInt stencil;
    PetscInt point;  ///< number among the stencil's points
  };
  std::vector<Use> uses_;  ///< in stencils that are not clamped, particle by particle
  std::vector<std::size_t> first_use_;
  std::vector<double> sums_;          ///< scratch for a row, of the local particles; 0 between rows
  std::vector<std::size_t> clamped_;  ///< stencils
  std::vector<Curvature3> rows_of_;   ///< the stiffness from which the entries were made
  std::size_t fits_of_rows_ = 0;      ///< BendingStencils::fits when the entries were made
};

}  // namespace pellicle::elastic
