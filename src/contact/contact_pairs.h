#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "contact/contact_laws.h"
#include "contact/contact_mesh.h"
#include "geometry/nearest_points.h"

namespace pellicle::contact {

/// A point and a triangle, or two edges, that may touch.
struct ContactPair {
  std::array<PetscInt, 4> points;  ///< of the mesh: the point and the triangle's corners, or the edges' ends
  bool are_edges = false;
  Barrier barrier;
  // From the last `measure`:
  double distance = 0;                               ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< from the second feature to the first
  bool may_press = false;                            ///< whether the gap may become less than the barrier's thickness

  /// @param corners places of the points
  NearestPoints nearest_of(const std::array<Eigen::Vector3d, 4>& corners) const {
    return are_edges ? nearest_of_edges(corners) : nearest_of_point_and_triangle(corners);
  }
  NearestPoints nearest(const Eigen::Matrix3Xd& places) const {
    const auto& [a, b, c, d] = points;
    return nearest_of({places.col(a), places.col(b), places.col(c), places.col(d)});
  }
  void measure(const Eigen::Matrix3Xd& places) {
    normal = nearest(places).apart;
    distance = normal.norm();
    normal /= distance > 0 ? distance : 1;
  }
  /// Direction from a point towards the other feature, along the normal of the last `measure`.
  Eigen::Vector3d inwards(int k) const { return is_second(k) ? normal : Eigen::Vector3d(-normal); }
  /// Components of the points' places, or displacements, inwards.
  Eigen::Array4d inwards(const Eigen::Matrix3Xd& places) const {
    Eigen::Array4d result;
    for (int k = 0; k < 4; ++k) {
      result[k] = inwards(k).dot(places.col(points[k]));
    }
    return result;
  }
  /// The largest number of each feature's points.
  Eigen::Array2d largest(const Eigen::Array4d& numbers) const {
    return are_edges ? Eigen::Array2d(numbers.head<2>().maxCoeff(), numbers.tail<2>().maxCoeff())
                     : Eigen::Array2d(numbers[0], numbers.tail<3>().maxCoeff());
  }
  /// Lower bound of the features' distance, along the normal of the last `measure` [m].
  double separation(const Eigen::Matrix3Xd& places) const { return -largest(inwards(places)).sum(); }
  /// Second derivative of a gap, which must not be 0, by the points [1/m].
  Eigen::Matrix<double, 12, 12> gap_curvature(const Eigen::Matrix3Xd& places) const;
  /// Number of points of the first feature.
  int first_feature() const { return are_edges ? 2 : 1; }
  bool is_second(int k) const { return k >= first_feature(); }
};

/// Share of their distance by which two features may come nearer before it is measured again.
constexpr double room_share = 0.9;

/// Finds the pairs of features without a common point of which this rank owns a part, and which may come to press, or
/// use up the clearance between them, within the range of their points' movement. They press from half of their
/// undeformed distance on, if that is less than the thickness: neighbours are near each other at rest. Features that
/// are in one place undeformed press from `lip_share` of the thickness on, and are no pair as long as they are in one
/// place. Not collective.
/// @param places of the mesh's points, for which the mesh was gathered [m]
/// @param pairs those of the last call, set to the present ones; kept if no point's range is new (is_new)
/// @returns whether there are features that touch: at distance 0, without a point of each in one place. As it is not
/// known on which side of each other they are, they are no pair, and may pass through each other
bool renew_contact_pairs(const ContactMesh& mesh, const Eigen::Matrix3Xd& places, std::vector<ContactPair>& pairs);

}  // namespace pellicle::contact
