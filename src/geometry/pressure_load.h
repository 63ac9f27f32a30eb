#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "geometry/cross_matrix.h"

namespace pellicle::geometry {

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
inline double solid_angle(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3) {
  const double r1 = x1.norm();
  const double r2 = x2.norm();
  const double r3 = x3.norm();
  return 2 * std::atan2(x1.dot(x2.cross(x3)), r1 * r2 * r3 + x1.dot(x2) * r3 + x2.dot(x3) * r1 + x3.dot(x1) * r2);
}

/// Area vector of a triangle, A n [m^2]; a third of it is the derivative of the volume by each corner, summed over the
/// triangles round a vertex (balloon paper, eq. 15).
inline Eigen::Vector3d area_vector(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3) {
  return 0.5 * (x2 - x1).cross(x3 - x1);
}

/// Area vector of a quad with these corners round it, which may be warped: half the cross product of its diagonals
/// [m^2].
inline Eigen::Vector3d quad_area_vector(const Eigen::Vector3d& x0, const Eigen::Vector3d& x1, const Eigen::Vector3d& x2,
                                        const Eigen::Vector3d& x3) {
  return 0.5 * (x2 - x0).cross(x3 - x1);
}

/// Adds the load's stiffness, minus the derivative of the force by the corners' positions `x` [m] at constant pressure,
/// times their displacements `w` [m] to `result` [N].
/// @param pressure inside minus outside, where the normals point [Pa]
inline void add_pressure_stiffness_action(double pressure, const Eigen::Vector3d x[3], const Eigen::Vector3d w[3],
                                          Eigen::Vector3d result[3]) {
  const Eigen::Vector3d product = pressure / 6 * ((x[2] - x[0]).cross(w[1] - w[0]) - (x[1] - x[0]).cross(w[2] - w[0]));
  for (int corner = 0; corner < 3; ++corner) {
    result[corner] += product;
  }
}

/// Block to be added to the stiffness at a side without a neighbour to get the symmetric part of the derivative: once
/// from either end to the other, and twice at both ends [N/m].
/// @param from first end of the side, in the order of its triangle's corners @param to second end [m]
inline Eigen::Matrix3d rim_stiffness(double pressure, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return cross_matrix(-pressure / 12 * (to - from));
}

}  // namespace pellicle::geometry
