#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::geometry {

/// Pose of a rigid solid: its own frame in the world.
struct Pose {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  ///< rotation matrix
  Eigen::Vector3d place = Eigen::Vector3d::Zero();     ///< of the own frame's origin [m]

  Eigen::Vector3d to_world(const Eigen::Vector3d& own) const { return place + turn * own; }
  Eigen::Vector3d to_own(const Eigen::Vector3d& world) const { return turn.transpose() * (world - place); }
};

/// The rotation about the direction of `vector` by its length [rad].
Eigen::Matrix3d rotation_matrix(const Eigen::Vector3d& vector);

/// The smallest rotation that turns one direction into another; for opposite ones half a turn about any normal axis.
Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Motion of a solid: its origin moves along key points or at a constant velocity, and it turns about the origin by a
/// rotation vector with key points or at a constant angular velocity.
struct RigidMotion {
  Pose start;                                                  ///< at time 0, but for `path` and `rotation`
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< [m/s]
  std::vector<std::vector<double>> path;                       ///< time [s], x, y, z [m]; replaces place and velocity
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
  std::vector<std::vector<double>> rotation;  ///< time [s], x, y, z [rad]: a vector, linear between rows

  /// The pose at a time [s].
  Pose at(double time) const;
};

/// Message if a motion is invalid; otherwise empty. It follows the key of the moving object, as for fault_of_motion.
std::string fault_of(const RigidMotion& motion);

}  // namespace pellicle::geometry
