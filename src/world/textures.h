#pragma once

#include <mpi.h>

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "io/texture.h"

namespace pellicle {
inline namespace world {

/// The pictures of a run whose values at texture coordinates weight something. Each file is read once: a sheet that is
/// compacted later asks for it again.
class Textures {
 public:
  explicit Textures(MPI_Comm comm) : comm_(comm) {}

  /// The values that the brightness of a PNG gives at texture coordinates; empty when `file` is. Collective.
  /// @param uv of this rank's items, (2 x items), or no columns where the mesh has none
  /// @param key of the option that names the file
  /// @param range where the picture is black and where it is white
  /// @throws Error, on all ranks, if the file cannot be read, or if the mesh has no texture coordinates
  std::vector<double> values(const Eigen::Matrix2Xd& uv, const std::string& key, const std::string& file,
                             const std::vector<double>& range = {0, 1});

 private:
  MPI_Comm comm_;
  std::map<std::string, Texture> read_;  ///< by file
};

}  // namespace world
}  // namespace pellicle
