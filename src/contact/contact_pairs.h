#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "contact/barrier.h"
#include "contact/contact_mesh.h"
#include "geometry/nearest_points.h"

namespace pellicle {
inline namespace contact {

/// A point and a triangle, or two edges, that may touch.
struct ContactPair {
  std::array<PetscInt, 4> points;  ///< of the mesh: the point and the triangle's corners, or the edges' ends
  bool are_edges = false;
  Barrier barrier;
  double distance = 0;  ///< where it was found [m]

  NearestPoints nearest(const Eigen::Matrix3Xd& places) const {
    const std::array<Eigen::Vector3d, 4> corners{places.col(points[0]), places.col(points[1]), places.col(points[2]),
                                                 places.col(points[3])};
    return are_edges ? nearest_of_edges(corners) : nearest_of_point_and_triangle(corners);
  }
  /// Second derivative of a gap, which is not 0, by the points [1/m].
  Eigen::Matrix<double, 12, 12> gap_curvature(const Eigen::Matrix3Xd& places) const;
  /// How many of the points are of the first feature.
  int first_feature() const { return are_edges ? 2 : 1; }
};

/// What a search for pairs has found.
struct ContactPairs {
  std::vector<ContactPair> pairs;  ///< nearer than the sum of their features' margins
  std::vector<double> nearest;     ///< of each point of the mesh, to what it is in a pair with [m]; infinity: nothing
};

/// Looks for all pairs of features without a common point of which this rank owns a part. They
/// touch from half of their undeformed distance on, if that is less than the thickness: neighbours are near each other
/// at rest. Where that is nothing, as between the lips of a crack, there is no pair. Not collective.
/// @param places of the mesh's points, for which it was gathered [m]
/// @param stiffness pressure over depth [Pa/m]
ContactPairs find_contact_pairs(const ContactMesh& mesh, const Eigen::Matrix3Xd& places, double stiffness);

}  // namespace contact
}  // namespace pellicle
