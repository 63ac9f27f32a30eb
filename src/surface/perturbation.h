#pragma once

#include <Eigen/Core>

#include "surface/point_set.h"
#include "surface/sheet_options.h"

namespace pellicle {

/// Rest positions plus the initial noise of the options: each component uniform in +- perturbation times `mean_edge`, a
/// function of seed and persistent id only. @returns (3 x local) [m]. Not collective.
Eigen::Matrix3Xd perturbed_positions(const PointSet& points, const SheetOptions& options, double mean_edge);

}  // namespace pellicle
