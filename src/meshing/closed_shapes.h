#pragma once

#include <Eigen/Core>

#include "meshing/surface_mesh.h"

namespace pellicle::meshing {

// Closed meshes round the origin with normals outward, of triangles unless they say quads. Texture coordinates u go
// round the z axis from 0 on the negative x axis to 1, with a seam there, and v from 0 below to 1 above; they belong to
// face corners. Not collective.

/// An icosahedron with every triangle split in four `level` times, its points on a sphere [m]: 10 * 4^level + 2 points.
/// v goes with the angle from the z axis. @throws Error unless 0 <= level <= 9 and the radius is above 0.
SurfaceMesh icosphere_mesh(int level, double radius);

/// The icosphere stretched to an ellipsoid with half axes `semi_axes` along x, y, z [m]; the same texture coordinates.
/// @throws Error as the icosphere.
SurfaceMesh ellipsoid_mesh(int level, const Eigen::Vector3d& semi_axes);

/// An ellipsoid of quads: a cube with every side cut into 4^level squares, blown up: 6 * 4^level quads. The same
/// texture coordinates. @throws Error as the icosphere.
SurfaceMesh quad_ellipsoid_mesh(int level, const Eigen::Vector3d& semi_axes);

/// A tube along z: a cylinder of this length between two half spheres [m], by implicit_surface_mesh. v goes with z.
/// @throws Error unless the sizes are above 0 and the vertices are enough.
SurfaceMesh tube_mesh(double length, double radius, int vertices);

}  // namespace pellicle::meshing
