#pragma once

#include <algorithm>
#include <map>
#include <utility>

#include "mesh/surface_mesh.h"

namespace pellicle {

/// A ball round a centre: an octahedron whose triangles are divided in four `level` times, its points put on the
/// sphere, normals outwards. 4^(level + 1) + 2 points.
inline SurfaceMesh ball_mesh(int level, double radius, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  SurfaceMesh mesh;
  for (const double sign : {1.0, -1.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      mesh.points.push_back(sign * Eigen::Vector3d::Unit(axis));
    }
  }
  mesh.faces = {{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 0, 2}, {1, 0, 5}, {3, 1, 5}, {4, 3, 5}, {0, 4, 5}};
  for (int n = 0; n < level; ++n) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [entry, is_new] = middles.try_emplace({std::min(a, b), std::max(a, b)}, mesh.points.size());
      if (is_new) {
        mesh.points.push_back(
            (mesh.points[static_cast<std::size_t>(a)] + mesh.points[static_cast<std::size_t>(b)]).normalized());
      }
      return entry->second;
    };
    std::vector<std::vector<int>> faces;
    for (const auto& face : mesh.faces) {
      const int a = face[0];
      const int b = face[1];
      const int c = face[2];
      const int ab = middle(a, b);
      const int bc = middle(b, c);
      const int ca = middle(c, a);
      faces.insert(faces.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.faces = faces;
  }
  for (Eigen::Vector3d& point : mesh.points) {
    point = centre + radius * point;
  }
  return mesh;
}

/// Both meshes as one: the second's points and faces after the first's.
inline SurfaceMesh joined(SurfaceMesh first, const SurfaceMesh& second) {
  const auto offset = static_cast<int>(first.points.size());
  first.points.insert(first.points.end(), second.points.begin(), second.points.end());
  for (std::vector<int> face : second.faces) {
    for (int& point : face) {
      point += offset;
    }
    first.faces.push_back(face);
  }
  return first;
}

}  // namespace pellicle
