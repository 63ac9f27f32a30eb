#pragma once

#include "meshing/closed_shapes.h"

namespace pellicle {

/// Both meshes as one, the second moved: its points and faces after the first's. Both have texture coordinates, or
/// neither.
inline SurfaceMesh joined(SurfaceMesh first, const SurfaceMesh& second, const Eigen::Vector3d& shift) {
  const auto offset = static_cast<int>(first.points.size());
  for (const Eigen::Vector3d& point : second.points) {
    first.points.emplace_back(point + shift);
  }
  for (std::vector<int> face : second.faces) {
    for (int& point : face) {
      point += offset;
    }
    first.faces.push_back(face);
  }
  first.uv.insert(first.uv.end(), second.uv.begin(), second.uv.end());
  return first;
}

/// The half of an icosphere above z = 0, its rim in that plane. @param level at least 1: then edges lie there.
inline SurfaceMesh dome_mesh(int level, double radius) {
  const SurfaceMesh ball = icosphere_mesh(level, radius);
  SurfaceMesh dome;
  std::vector<int> number(ball.points.size(), -1);
  for (const auto& face : ball.faces) {
    double height = 0;
    for (const int point : face) {
      height += ball.points[point].z();
    }
    if (height < 0) {
      continue;
    }
    std::vector<int>& corners = dome.faces.emplace_back();
    for (const int point : face) {
      int& kept = number[point];
      if (kept < 0) {
        kept = static_cast<int>(dome.points.size());
        dome.points.push_back(ball.points[point]);
      }
      corners.push_back(kept);
    }
  }
  return dome;
}

}  // namespace pellicle
