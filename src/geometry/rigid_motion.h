#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace pellicle {
inline namespace geometry {

/// Where a rigid solid is: its own frame in the world.
struct Pose {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  ///< rotation matrix
  Eigen::Vector3d place = Eigen::Vector3d::Zero();     ///< of the own frame's origin [m]

  Eigen::Vector3d to_world(const Eigen::Vector3d& own) const { return place + turn * own; }
  Eigen::Vector3d to_own(const Eigen::Vector3d& world) const { return turn.transpose() * (world - place); }
};

/// The rotation about the direction of `vector` by its length [rad].
Eigen::Matrix3d rotation_matrix(const Eigen::Vector3d& vector);

/// The smallest rotation that turns one direction into another; of opposite ones half a turn about some axis across.
Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// How a solid moves: its origin along key points or at a constant velocity, and it turns about its origin by a
/// rotation vector with key points or at a constant angular velocity.
struct RigidMotion {
  Pose start;                                                  ///< at time 0, but for `path` and `rotation`
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< [m/s]
  std::vector<std::vector<double>> path;                       ///< time [s], x, y, z [m]; replaces place and velocity
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
  std::vector<std::vector<double>> rotation;  ///< time [s], x, y, z [rad]: a vector, linear between rows

  /// At a time [s].
  Pose at(double time) const;
};

/// Why a motion is invalid: empty, or words to follow the key of what moves, as fault_of_motion gives them.
std::string fault_of(const RigidMotion& motion);

}  // namespace geometry
}  // namespace pellicle
