#include "geometry/triangle_intersection.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace pellicle::geometry {

namespace {

/// Six times the signed volume of the tetrahedron a b c d; 0 if it may be rounding, that is if all lie in one plane.
double orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   const Eigen::Vector3d& d) {
  const Eigen::Vector3d u = b - a, v = c - a, w = d - a;
  const double value = u.cross(v).dot(w);
  const double rounding = 8 * std::numeric_limits<double>::epsilon() * u.norm() * v.norm() * w.norm();
  return std::abs(value) > rounding ? value : 0;
}

}  // namespace

bool segment_cuts_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Triangle& t) {
  // The ends lie on either side of the plane, and the line passes all three edges on the same side.
  if (orientation(t[0], t[1], t[2], p) * orientation(t[0], t[1], t[2], q) >= 0) {
    return false;
  }
  const double s0 = orientation(p, q, t[0], t[1]);
  const double s1 = orientation(p, q, t[1], t[2]);
  const double s2 = orientation(p, q, t[2], t[0]);
  return (s0 > 0 && s1 > 0 && s2 > 0) || (s0 < 0 && s1 < 0 && s2 < 0);
}

bool triangles_intersect(const Triangle& first, const Triangle& second) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (segment_cuts_triangle(first[k], first[(k + 1) % 3], second) ||
        segment_cuts_triangle(second[k], second[(k + 1) % 3], first)) {
      return true;
    }
  }
  return false;
}

}  // namespace pellicle::geometry
