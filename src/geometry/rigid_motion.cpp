#include "geometry/rigid_motion.h"

#include <Eigen/Geometry>
#include <cmath>

#include "geometry/key_points.h"
#include "geometry/pi.h"

namespace pellicle::geometry {

Eigen::Matrix3d rotation_matrix(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle == 0) {
    return Eigen::Matrix3d::Identity();
  }
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

// Not Quaterniond::FromTwoVectors, whose singular value decomposition takes long to compile.
Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.stableNormalized(), b = to.stableNormalized();  // of any length
  const Eigen::Vector3d axis = a.cross(b);
  const double sine = axis.norm(), cosine = a.dot(b);
  if (sine == 0) {
    return cosine < 0 ? rotation_matrix(pi * from.unitOrthogonal()) : Eigen::Matrix3d::Identity().eval();
  }
  return rotation_matrix(std::atan2(sine, cosine) / sine * axis);
}

Pose RigidMotion::at(double time) const {
  Pose pose = start;
  pose.place = path.empty() ? Eigen::Vector3d(start.place + time * velocity) : place_on_key_points(path, time);
  if (!rotation.empty() || !angular_velocity.isZero(0)) {
    pose.turn = rotation_matrix(place_of_motion(rotation, angular_velocity, time)) * start.turn;
  }
  return pose;
}

std::string fault_of(const RigidMotion& motion) {
  const std::string fault = fault_of_motion(motion.path, motion.velocity);
  return fault.empty() ? fault_of_motion(motion.rotation, motion.angular_velocity, "rotation", "angular_velocity")
                       : fault;
}

}  // namespace pellicle::geometry
