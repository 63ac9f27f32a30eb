#pragma once

#include <mpi.h>

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::io {

/// A grey picture that gives a factor at texture coordinates: the mass-loss rate, the diffusivity, a constraint weight.
struct Texture {
  int width = 0;
  int height = 0;
  std::vector<double> grey;  ///< in [0, 1], rows from the lower edge up

  /// Reads a PNG file on rank 0 (read_png) and sends it to all ranks. Collective. @throws Error, on all ranks, if the
  /// file is missing, no PNG, damaged, or too large.
  static Texture read(MPI_Comm comm, const std::string& path);

  /// Value in [0, 1] at (u, v), bilinear between the centres of the pixels; v = 0 is the lower edge. Outside the
  /// picture the value is that of its edge.
  double sample(double u, double v) const;
};

/// Reads a PNG file of any kind: 1 to 16 bits, grey, colour or palette, interlaced or not. Colours become the mean of
/// their channels; transparency is dropped, and no gamma is applied. Not collective.
/// @throws Error in one line if the file is missing, no PNG or damaged, or if the picture that its header announces has
/// more than 2^26 pixels (8192 x 8192) or does not fit in memory, which is found before it is decoded.
Texture read_png(const std::string& path);

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

}  // namespace pellicle::io
