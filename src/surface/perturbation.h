#pragma once

#include <Eigen/Core>

#include "surface/sheet_options.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace surface {

/// Rest positions plus the initial noise of the options: each component is uniform in +- perturbation times
/// `mean_edge`, and depends only on seed and persistent id. @returns (3 x local) [m]. Not collective.
Eigen::Matrix3Xd perturbed_positions(const Surface& points, const SheetOptions& options, double mean_edge);

}  // namespace surface
}  // namespace pellicle
