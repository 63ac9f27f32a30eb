#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "base/namespaces.h"

namespace pellicle::base {

/// A uniform random number in [-1, 1) that depends on seed and number alone, so that it is the same on every rank.
double noise(int seed, std::uint64_t number);

/// A random field in space that depends on the seed alone: smooth, and at every place a uniform number in [-1, 1]. The
/// correlation between two places is 2/3 at a distance of 1/2, 1/5 at 1, and none at 2 and more.
/// @param place in units of the field's length, each coordinate at most 1e15 in size
double noise(int seed, const Eigen::Vector3d& place);

}  // namespace pellicle::base
