#pragma once

#include <Eigen/Core>

#include "prism/metric_energy.h"

namespace pellicle {
inline namespace prism {

/// Principal stretches and stresses of an element, the larger stretch first.
struct PrincipalState {
  Eigen::Vector2d stretch;  ///< length over undeformed length
  Eigen::Vector2d stress;   ///< Cauchy stress in the plane of the wall [Pa]
};

/// @param e12, e13 deformed edges [m]
/// @param thickness_ratio h/h0, as for metric_energy
PrincipalState principal_state(const Material& material, ThicknessRule rule, const RestMetric& rest,
                               const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, double thickness_ratio);

/// Cauchy stress times present thickness [N/m].
/// @param gradient of the elastic energy by the metric (MetricEnergy) [N]
Eigen::Matrix3d tension(const Eigen::Vector3d& gradient, const Eigen::Vector3d& e12, const Eigen::Vector3d& e13);

}  // namespace prism
}  // namespace pellicle
