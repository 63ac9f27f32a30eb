#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/handle.h"
#include "prism/prism_elements.h"
#include "prism/prism_options.h"

namespace pellicle {

/// What a tangent is made of besides the elements' stiffness.
struct TangentInput {
  const Field& positions;                             ///< [m], ghosts up to date
  const std::vector<double>& thickness_ratio;         ///< of the local elements
  const std::vector<double>& load_pressure;           ///< of the local elements: whose load stiffness enters [Pa], or empty
  Eigen::Vector3d load_origin;                        ///< about which it is taken [m]
  const std::vector<Eigen::Matrix3d>& vertex_blocks;  ///< added to the diagonal block of each owned vertex [N/m]
  double lagged_factor = 0;                           ///< times the stiffness that `lag` kept: stiffness damping
};

/// The system matrix of a Newton iteration without the gas's low-rank part: P (K + loads + vertex blocks) P + s (1 - P)
/// with projectors P on the directions in which the vertices may move (and s the mean of the diagonal, so that held
/// directions do not spoil the spectrum). Assembled (baij, aij, sbaij; block size 3) or matrix-free (shell).
class PrismTangent {
 public:
  /// Makes pattern and matrix. Collective. @param projectors of the local vertices
  PrismTangent(const PrismElements& elements, const PrismOptions& options,
               const std::vector<Eigen::Matrix3d>& projectors);

  /// Keeps the stiffness at these positions for `lagged_factor`. Not collective.
  void lag(const Field& positions, const std::vector<double>& thickness_ratio);

  /// Adds `factor` times the kept stiffness times `displacement` (local, ghosts up to date) to (3 x owned) `result`.
  void add_lagged_product(double factor, const Field& displacement, Eigen::Matrix3Xd& result) const;

  /// Sets the values. Collective.
  void update(const TangentInput& input);

  Mat matrix() const;
};

}  // namespace pellicle
