#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace pellicle {
inline namespace geometry {

// The load of a pressure p on a triangle, (p/3) A n on every corner (balloon paper, eq. 15), and its derivative. Summed
// over a surface that is closed, or whose boundary stays in planes that close it, the force is p dV/dx, and its
// derivative is symmetric. At sides without a neighbour it is not, and rim_stiffness gives what leads to its symmetric
// part.

/// Share of a triangle in the enclosed volume (balloon paper, eq. 13) [m^3].
inline double enclosed_volume(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3) {
  return x1.dot(x2.cross(x3)) / 6;
}

/// Solid angle of a triangle as seen from the origin, positive where its normal points away (Van Oosterom and Strackee
/// 1983) [sr].
double solid_angle(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3);

/// Area vector of a triangle, A n [m^2]; a third of it is the derivative of the volume by each corner, summed over the
/// triangles round a vertex (balloon paper, eq. 15).
inline Eigen::Vector3d area_vector(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3) {
  return 0.5 * (x2 - x1).cross(x3 - x1);
}

/// Adds the load's stiffness, minus the derivative of the force by the corners' positions `x` [m] at constant pressure,
/// times their displacements `w` [m] to `result` [N].
/// @param pressure inside minus outside, where the normals point [Pa]
void add_pressure_stiffness_action(double pressure, const Eigen::Vector3d x[3], const Eigen::Vector3d w[3],
                                   Eigen::Vector3d result[3]);

/// Block to be added to the stiffness at a side without a neighbour to get the symmetric part of the derivative: once
/// from either end to the other, and twice at both ends [N/m].
/// @param from first end of the side, in the order of its triangle's corners @param to second end [m]
Eigen::Matrix3d rim_stiffness(double pressure, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace geometry
}  // namespace pellicle
