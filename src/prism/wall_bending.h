#pragma once

#include <Eigen/Core>
#include <vector>

#include "energies/potential.h"
#include "geometry/projectors.h"
#include "parallel/field.h"
#include "prism/plate_stencils.h"
#include "prism/prism_elements.h"

namespace pellicle::prism {

/// The bending of the wall, a plate of its present thickness h (Koiter's energy of a thin shell):
///
///     sum_i A_i D_i / 2 ((1 - nu) k:k + nu (tr k)^2),   D = E h^3 / (12 (1 - nu^2)) = mu h^3 / (6 (1 - nu)),
///
/// with the moduli of small strain, nu = 1/2 where elements keep their volume. k is the change b - b0 of the second
/// fundamental form at vertex i (PlateStencil) since the undeformed shape, in present lengths: k = a^-1/2 (b - b0)
/// a^-1/2 with the present metric a, both in undeformed coordinates. So a flat wall that is stretched and then bent
/// resists like a plate of its new lengths and thickness, and an undeformed wall of any shape is at rest. In a wall
/// that shrinks to s times its lengths b0 becomes s b0, the curvature of the smaller shape. A triangle's area is
/// divided among those of its vertices that have a stencil; a vertex on a triangle that has died has none.
///
/// h, a and the areas are those at the start of the step, so that gradient and Hessian are exact derivatives of the
/// energy during a solve.
class WallBending : public Potential {
 public:
  /// Collective. Elements must outlive this object. @param projectors, clamped as for plate_stencils
  WallBending(const PrismElements& elements, const Projectors& projectors, const std::vector<bool>& clamped);

  /// Begins a step with thickness and metric of `start`. Collective.
  /// @param thickness_ratio h/h0 of the local elements
  void begin_step(const Field& start, const std::vector<double>& thickness_ratio) {
    plates_ = plates(start, thickness_ratio);
  }
  /// This rank's fraction of the energy in a step that starts at x [J]. Collective.
  double energy(const Field& x, const std::vector<double>& thickness_ratio) const {
    return sum_of(plates(x, thickness_ratio), x);
  }

  double value(const Field& x) const override { return sum_of(plates_, x); }
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override { add_value_and_gradient(x, gradient); }
  double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  /// The positive part leaves out the term of the bending moments by the turning of normals.
  void update_hessian(const Field& x, double psd_blend) override;
  void add_hessian(const HessianBlocks& blocks) const override;

 private:
  /// Data of a stencil for its vertex, from the start of the step.
  struct Plate {
    Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();  ///< of b, times the area [N m^3]
    PlateCurvature target = PlateCurvature::Zero();       ///< b0 [1/m]
    double reference = 0;                                 ///< |N| unless folded; 0: the stencil is not used [m^2]
  };
  /// A stencil at positions x.
  struct State {
    Eigen::Matrix3d bent;  ///< sum_p w_pk x_p as column k [1/m]
    Eigen::Vector3d area;  ///< N [m^2]
    Eigen::Vector3d normal;
    double length;            ///< |N|, bounded away from 0 [m^2]
    Eigen::Vector3d moments;  ///< by b [J m]

    double energy(const Plate& plate) const { return moments.dot(bent.transpose() * normal - plate.target) / 2; }
  };

  std::vector<Plate> plates(const Field& start, const std::vector<double>& thickness_ratio) const;
  double sum_of(const std::vector<Plate>& plates, const Field& x) const;
  const double* reach(const Field& x) const;
  State state(const PlateStencil& stencil, const Plate& plate, const double* x) const;
  void find_turning(const PlateStencil& stencil, const double* x, Eigen::Matrix3Xd& turning) const;

  const PrismElements& elements_;
  PlateStencils stencils_;
  std::vector<double> stiffness_;  ///< D/h^3 of the local elements [Pa]
  std::vector<double> poisson_;    ///< nu of the local elements
  std::vector<Plate> plates_;      ///< of the stencils
  Eigen::Index most_points_ = 0;   ///< largest number of points of a stencil
  mutable Field beyond_;           ///< positions in the stencils' reach
  Eigen::Matrix3Xd linearised_;    ///< positions at which the Hessian was taken
  double kept_moments_ = 1;        ///< fraction of the term of the moments in the Hessian
};

}  // namespace pellicle::prism
