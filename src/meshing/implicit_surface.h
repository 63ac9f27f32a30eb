#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <string>

#include "meshing/surface_mesh.h"

namespace pellicle::meshing {

/// A closed surface as the set where a smooth function of the point is 0; below 0 is inside.
struct ImplicitSurface {
  std::function<double(const Eigen::Vector3d&)> value;  ///< about the distance [m], near the surface
  Eigen::AlignedBox3d bounds;                           ///< holds the whole surface

  /// The gradient at a point, by differences from the value there.
  Eigen::Vector3d gradient(const Eigen::Vector3d& point, double value_there) const;
  /// One Newton step towards the surface, along the gradient, no longer than `longest`. @returns the displacement
  Eigen::Vector3d step_onto(const Eigen::Vector3d& point, double longest) const;
};

/// Triangles of an implicit surface with `vertices` points, normals outward, all nearly of the same size and
/// equilateral: flying edges (VTK) on a grid, relaxed by IsotropicRemesher. Deterministic, not collective.
/// @param key of the surface in messages
/// @throws Error in one line if there is no surface in the bounds or the vertices are too few to follow it.
SurfaceMesh implicit_surface_mesh(const ImplicitSurface& surface, int vertices, const std::string& key);

}  // namespace pellicle::meshing
