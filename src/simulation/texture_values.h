#pragma once

#include <mpi.h>

#include <Eigen/Core>
#include <string>
#include <vector>

namespace pellicle {

/// The brightness of a PNG, 0 to 1, at texture coordinates; empty when `file` is. Collective.
/// @param uv of this rank's items, (2 x items), or no columns where the mesh has none
/// @param key of the option that names the file
/// @throws Error, on all ranks, if the file cannot be read, or if the mesh has no texture coordinates
std::vector<double> texture_values(MPI_Comm comm, const Eigen::Matrix2Xd& uv, const std::string& key,
                                   const std::string& file);

}  // namespace pellicle
