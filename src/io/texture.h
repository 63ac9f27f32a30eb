#pragma once

#include <mpi.h>

#include <string>

#include "io/png_reader.h"

namespace pellicle {
inline namespace io {

/// A grey picture that gives a factor at texture coordinates: the mass-loss rate, the diffusivity, a constraint weight.
class Texture {
 public:
  /// Reads a PNG file on rank 0 (read_png) and sends it to all ranks. Collective. @throws Error, on all ranks, if the
  /// file is missing, no PNG, damaged, or too large.
  static Texture read(MPI_Comm comm, const std::string& path);

  /// Value in [0, 1] at (u, v), bilinear between the centres of the pixels; v = 0 is the lower edge. Outside the
  /// picture the value is that of its edge.
  double sample(double u, double v) const;

  int width() const { return picture_.width; }
  int height() const { return picture_.height; }

 private:
  double pixel(int column, int row) const;

  Picture picture_;
};

}  // namespace io
}  // namespace pellicle
