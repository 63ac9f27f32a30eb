#include "air/air_drag.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>

#include "surface/drawn_surface.h"

namespace pellicle::air {

AirDrag::AirDrag(const Surface& surface, const AirOptions& options)
    : surface_(surface),
      options_(options),
      wind_(options.wind),
      resistance_(surface.particles.owned, Eigen::Matrix3d::Zero()),
      impulse_(Eigen::Matrix3Xd::Zero(3, surface.particles.owned)) {}

void AirDrag::begin_step(const Field& position, const Field& velocity, const std::vector<double>& mass,
                         const std::vector<bool>* active, double time) {
  const PetscInt owned = surface_.particles.owned;
  resistance_.assign(owned, Eigen::Matrix3d::Zero());
  impulse_.setZero(3, owned);
  wind_.set_time(time);
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    if (active != nullptr && !(*active)[t]) {
      continue;
    }
    const std::array<PetscInt, 3>& triangle = surface_.triangles[t];
    const auto [x0, x1, x2] = places_of_triangle(surface_, position.data(), t);
    const Eigen::Vector3d area_vector = (x1 - x0).cross(x2 - x0) / 2;
    const double area = area_vector.norm();
    if (area == 0) {
      continue;
    }
    std::array<double, 3> fraction = surface_.point_shares();
    if (surface_.has_quads() && mass[triangle[2]] == 0) {
      fraction = {0.5, 0.5, 0};
    }
    Eigen::Vector3d mean_velocity = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      mean_velocity += fraction[k] * velocity.vector(triangle[k]);
    }
    const Eigen::Vector3d wind = wind_.at((x0 + x1 + x2) / 3);
    const Eigen::Vector3d normal = area_vector / area;
    const Eigen::Vector3d u = wind - mean_velocity;
    const Eigen::Vector3d u_n = u.dot(normal) * normal;
    const double across = options_.density * area / 2 * options_.drag * u_n.norm();
    const double along = options_.density * area / 2 * options_.skin_drag * (u - u_n).norm();
    const Eigen::Matrix3d resistance =
        along * Eigen::Matrix3d::Identity() + (across - along) * normal * normal.transpose();
    const Eigen::Vector3d push = resistance * wind;
    for (std::size_t k = 0; k < 3; ++k) {
      if (triangle[k] < owned) {
        resistance_[triangle[k]] += fraction[k] * resistance;
        impulse_.col(triangle[k]) += fraction[k] * push;
      }
    }
  }
}

void AirDrag::accelerate(Field& velocity, const std::vector<double>& mass, double h) const {
  for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
    const double m = mass[i];
    if (m > 0) {
      const Eigen::Matrix3d inertia = m * Eigen::Matrix3d::Identity() + h * resistance(i);
      velocity.vector(i) = inertia.inverse() * (m * velocity.vector(i) + h * push(i));
    }
  }
  velocity.update_ghosts();
}

}  // namespace pellicle::air
