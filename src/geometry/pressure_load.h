#pragma once

#include <Eigen/Core>

namespace pellicle {
inline namespace geometry {

// The load of a pressure p on a triangle, and its derivative. All positions [m] are relative to one point o for the
// whole surface: any point if it is closed, else a point of all planes that close it and to which its boundary is
// bound.
//
// The gas's volume is V = sum over the triangles of x1.(x2 x x3)/6 (balloon paper, eq. 13), the force on a vertex
// p dV/dx. A triangle's share, (p/6) x2 x x3 on its first corner, sums up to that of eq. 15, (p/3) A n, on every vertex
// (for a vertex in a closing plane: along the plane). Unlike eq. 15's, its derivative is symmetric triangle by
// triangle.

/// Share of a triangle in the enclosed volume (balloon paper, eq. 13) [m^3].
double enclosed_volume(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3);

/// Area vector of a triangle, A n [m^2]; a third of it is the derivative of the volume by each corner, summed over the
/// triangles round a vertex (balloon paper, eq. 15).
Eigen::Vector3d area_vector(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3);

/// Adds the load's stiffness, minus the derivative of the force by the corners' positions `x` [m] at constant pressure,
/// times their displacements `w` [m] to `result` [N], in the symmetric form: summed over the surface, exact.
/// @param pressure inside minus outside, where the normals point [Pa]
void add_pressure_stiffness_action(double pressure, const Eigen::Vector3d x[3], const Eigen::Vector3d w[3],
                                   Eigen::Vector3d result[3]);

}  // namespace geometry
}  // namespace pellicle
