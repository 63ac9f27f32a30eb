#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::geometry {

/// The place at `time` on a path given by key points.
/// @param rows (time [s], x, y, z [m]) each, at least one, times increasing (fault_of_key_points). Linear between two
/// rows, at rest before the first and after the last.
Eigen::Vector3d place_on_key_points(const std::vector<std::vector<double>>& rows, double time);

/// The integral from 0 to `time` of a quantity given by key points as for place_on_key_points.
Eigen::Vector3d integral_on_key_points(const std::vector<std::vector<double>>& rows, double time);

/// The value at `time` of a quantity given by key points (time [s], value), as for a path: a single row is a constant.
double value_on_key_points(const std::vector<std::vector<double>>& rows, double time);

/// Message if `rows` are no key points with given columns; otherwise empty.
std::string fault_of_key_points(const std::vector<std::vector<double>>& rows,
                                const std::vector<std::string>& columns = {"time", "x", "y", "z"});

/// Message if a motion along a path, or else at a constant velocity, is invalid; otherwise empty. It follows the key of
/// the moving object: ".path: key point 2 ..." or ": both path and velocity given, ...".
std::string fault_of_motion(const std::vector<std::vector<double>>& path, const Eigen::Vector3d& velocity,
                            const char* path_key = "path", const char* velocity_key = "velocity");

/// Place at `time` [s] of a motion along a path, or else velocity times time [m].
Eigen::Vector3d place_of_motion(const std::vector<std::vector<double>>& path, const Eigen::Vector3d& velocity,
                                double time);

}  // namespace pellicle::geometry
