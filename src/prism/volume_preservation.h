#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/stage_result.h"
#include "geometry/projectors.h"
#include "parallel/field.h"
#include "prism/prism_options.h"
#include "prism/wall.h"

namespace pellicle::prism {

/// Volume of a prism with a virtual fourth vertex and its gradient by the vertices (balloon paper, eq. 26, 28).
struct PrismVolume {
  double value = 0;                      ///< [m^3]
  Eigen::Matrix<double, 3, 4> gradient;  ///< by x1, x2, x3 and x4 [m^2]
};
PrismVolume prism_volume(const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, const Eigen::Vector3d& e14);

/// Vector from the first to the virtual vertex, which is in the middle of the prism's upper triangle [m].
Eigen::Vector3d edge_to_virtual_vertex(const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, double thickness);

/// Volume preservation of the wall by Algorithm 2: each piece of the membrane keeps its undeformed volume as a whole,
/// C = sum A h - V0 = 0 (eq. 24). The elements' thickness is a virtual vertex while positions are corrected.
///
/// Rules, with w = 1/m', m' from eq. 19 with 1/6 for the three vertices and 1/2 for the virtual one:
/// - mass: dx_i = -w_i C g_i / sum_j w_j |g_j|^2, which solves the linearised constraint exactly
/// - printed: dx_i = -(n w_i / sum_j w_j) w_i C g_i / sum_j |g_j|^2 (eq. 27 as printed), which diverges
/// - muller06: like printed, without the second w_i
class VolumePreservation {
 public:
  /// Membrane, wall and projectors must outlive this object. Collective.
  /// @param projectors on the directions in which each local vertex may move
  VolumePreservation(const Membrane& membrane, const Wall& wall, const Projectors& projectors,
                     const VolumeOptions& options);

  /// Corrects positions and thickness until the error is within the tolerance; in one correction an element keeps at
  /// least a tenth of its thickness. Collective.
  /// @param positions [m], ghosts up to date before and after
  /// @param thickness_ratio h/h0 of the local elements
  /// @returns `iterations`: corrections; `error`: largest |C| of a piece relative to its undeformed volume. Not
  /// converged if a correction made the error larger; positions and thickness are then restored. If all corrections are
  /// used and the error is still above the tolerance, the result is kept.
  StageResult advance(Field& positions, std::vector<double>& thickness_ratio) const;

 private:
  /// The constraints, one for each piece, at given positions.
  struct Constraint {
    Eigen::VectorXd value;              ///< C [m^3]
    Eigen::VectorXd squared_norm;       ///< sum of |g|^2, with the weights of the rule
    Eigen::Matrix3Xd gradient;          ///< by the owned vertices, where they may move [m^2]
    Eigen::Matrix3Xd virtual_gradient;  ///< by the virtual vertices of the local elements [m^2]
    Eigen::Matrix3Xd virtual_vertices;  ///< of the local elements [m]
    double error = 0;                   ///< largest |C| / V0
  };

  Constraint evaluate(const Field& positions, const std::vector<double>& thickness_ratio) const;
  void correct(Field& positions, std::vector<double>& thickness_ratio, const Constraint& constraint) const;

  const Membrane* membrane_;
  const Wall* wall_;
  const Projectors* projectors_;
  VolumeOptions options_;
  std::vector<int> piece_;                    ///< of each owned vertex
  std::vector<double> inverse_mass_;          ///< w of each owned vertex [1/kg]
  std::vector<double> virtual_inverse_mass_;  ///< w of the virtual vertex of each local element [1/kg]
  Eigen::VectorXd initial_volume_;            ///< V0 of each piece [m^3]
  Eigen::VectorXd mean_inverse_mass_;         ///< of the vertices of each piece, virtual ones included [1/kg]
};

}  // namespace pellicle::prism
