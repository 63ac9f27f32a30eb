#pragma once

#include <cmath>
#include <utility>

#include "meshing/surface_mesh.h"

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

/// A mesh at another place.
inline SurfaceMesh moved(SurfaceMesh mesh, const Eigen::Vector3d& shift) {
  for (Eigen::Vector3d& point : mesh.points) {
    point += shift;
  }
  return mesh;
}

/// The grid with its points moved by up to a fifth of a cell, also out of the plane.
inline SurfaceMesh irregular_mesh(int nx, int ny, double edge) {
  SurfaceMesh mesh = grid_mesh(nx, ny, edge);
  for (Eigen::Vector3d& point : mesh.points) {
    const Eigen::Vector3d phase = 40 * point / edge;
    point += 0.2 * edge *
             Eigen::Vector3d(std::sin(phase.x() + 2 * phase.y()), std::cos(3 * phase.x() - phase.y()),
                             std::sin(phase.y() - phase.x()));
  }
  return mesh;
}

}  // namespace pellicle
