#pragma once

#include <Eigen/Core>
#include <map>
#include <string>

#include "constraints/pins.h"
#include "geometry/projectors.h"
#include "options/options.h"
#include "surface/surface.h"

namespace pellicle::constraints {

/// A symmetry plane in a deck, one of the named objects `symmetry`. Vertices in the plane stay in it.
struct SymmetryOptions {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();  ///< any length
  std::string group;                                  ///< group of the mesh, whose vertices alone stay; empty: all
};

void describe(OptionTable& table, SymmetryOptions& options);

/// Freedom of the vertices: free, in planes or along lines of symmetry, or pinned. A vertex is bound to every plane, if
/// it is in the plane's group, that is nearer to its undeformed place than a millionth of the mesh's size.
struct Constraints {
  /// Collective. @throws Error that names the plane and the key: no vertex (of its group) in it, planes without a
  /// common point
  Constraints(const Surface& points, const std::map<std::string, SymmetryOptions>& symmetry, const Pins& pins);

  Projectors projectors;   ///< of the local particles
  Eigen::Vector3d origin;  ///< a point of all symmetry planes, the nearest to the middle of the undeformed mesh [m]
  SymmetryPlanes planes;
};

}  // namespace pellicle::constraints
