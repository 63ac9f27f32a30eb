#pragma once

#include <Eigen/Core>
#include <vector>

#include "surface/sheet.h"

namespace pellicle::elastic {

/// Undeformed areas of the local cells [m^2].
std::vector<double> cell_areas(const Sheet& sheet);

/// Direction of the warp at each local particle, in its tangent plane, (3 x local).
/// @param direction of the warp; it need not be a unit vector or lie in the surface
Eigen::Matrix3Xd warp_of(const Sheet& sheet, const Eigen::Vector3d& direction);

}  // namespace pellicle::elastic
