#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace pellicle {

/// The place at `time` on a path given by key points.
/// @param rows (time [s], x, y, z [m]) each, at least one, times growing: see `fault_of_key_points`. Linear between two
/// rows, at rest before the first and after the last.
Eigen::Vector3d place_on_key_points(const std::vector<std::vector<double>>& rows, double time);

/// What makes `rows` no path: in words, or empty.
std::string fault_of_key_points(const std::vector<std::vector<double>>& rows);

}  // namespace pellicle
