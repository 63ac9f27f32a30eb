#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "contact/bodies.h"
#include "mesh/field.h"
#include "mesh/point_set.h"

namespace pellicle {

/// Vertices tied to moving points by springs: one of the named objects `attachments`. Selects as pins do.
struct AttachmentOptions;
/// A force on a region: one of the named objects `forces`.
struct PushOptions;

/// Potential energy of what acts on one vertex, with derivatives by its position.
struct PointPotential {
  double value = 0;                                    ///< [J]
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  ///< minus the force [N]
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();   ///< positive semi-definite [N/m]
};

/// Loads that act on single vertices: soft attachments to moving points, forces on regions, and bodies (spheres and
/// planes) that press on the balloon, by a penalty of the depth and with lagged Coulomb friction.
class PointLoads {
 public:
  // Constructor: the contact engineer's. Collective.

  /// Fixes time and what is lagged (normal forces, tangents of friction) for the step that ends at `time_end` [s].
  /// @param start positions at the beginning of the step [m]
  void begin_step(const Field& start, double time_end, double h);

  /// Of a local particle at position x [m]. Not collective.
  PointPotential at(PetscInt particle, const Eigen::Vector3d& x) const;

  bool empty() const;
};

}  // namespace pellicle
