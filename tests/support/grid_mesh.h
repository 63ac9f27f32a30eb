#pragma once

#include "mesh/surface_mesh.h"

namespace pellicle {

/// A flat grid of nx x ny square cells of the given edge in the x-y plane, numbered row by row, with uv.
inline SurfaceMesh grid_mesh(int nx, int ny, double edge) {
  SurfaceMesh mesh;
  for (int j = 0; j <= ny; ++j) {
    for (int i = 0; i <= nx; ++i) {
      mesh.points.emplace_back(i * edge, j * edge, 0.0);
    }
  }
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const int first = j * (nx + 1) + i;
      mesh.faces.push_back({first, first + 1, first + nx + 2, first + nx + 1});
      auto& uv = mesh.uv.emplace_back();
      for (const auto& [di, dj] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
        uv.emplace_back(static_cast<double>(i + di) / nx, static_cast<double>(j + dj) / ny);
      }
    }
  }
  return mesh;
}

}  // namespace pellicle
