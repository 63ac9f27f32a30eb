#pragma once

#include <cmath>
#include <string>

#include "meshing/surface_mesh.h"

namespace pellicle {

/// A flat mesh in the x-y plane whose points, but for those of a group, are shaken within the plane by up to `size`.
inline SurfaceMesh shaken(SurfaceMesh mesh, double size, const std::string& constrained) {
  std::vector<bool> stays(mesh.points.size(), false);
  for (const int point : mesh.groups.at(constrained)) {
    stays[point] = true;
  }
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    for (int c = 0; !stays[i] && c < 2; ++c) {
      mesh.points[i][c] += size * std::sin(12.9898 * static_cast<double>(i + 1) + 78.233 * (c + 1));
    }
  }
  return mesh;
}

}  // namespace pellicle
