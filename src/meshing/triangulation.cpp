#include "meshing/triangulation.h"

#include <algorithm>

#include "base/error.h"
#include "geometry/ear_clipping.h"
#include "geometry/pressure_load.h"

namespace pellicle::meshing {

using Corners = std::array<std::size_t, 3>;

std::vector<Corners> split_face(const SurfaceMesh& mesh, std::size_t face) {
  const std::size_t count = mesh.faces[face].size();
  if (count == 3) {
    return {{0, 1, 2}};
  }
  if (count == 4) {
    const double diagonal_02 = (mesh.corner(face, 2) - mesh.corner(face, 0)).squaredNorm();
    const double diagonal_13 = (mesh.corner(face, 3) - mesh.corner(face, 1)).squaredNorm();
    if (diagonal_02 <= diagonal_13) {
      return {{0, 1, 2}, {0, 2, 3}};
    }
    return {{0, 1, 3}, {1, 2, 3}};
  }
  std::vector<Eigen::Vector3d> corners;
  for (std::size_t k = 0; k < count; ++k) {
    corners.push_back(mesh.corner(face, k));
  }
  return cut_ears(corners);
}

SurfaceMesh triangulated(const SurfaceMesh& mesh) {
  if (std::all_of(mesh.faces.begin(), mesh.faces.end(), [](const auto& face) { return face.size() == 3; })) {
    return mesh;
  }
  SurfaceMesh result;
  result.points = mesh.points;
  result.groups = mesh.groups;
  result.remarks = mesh.remarks;
  result.point_id = mesh.point_id;
  std::vector<int> first_triangle;  // of each face
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    first_triangle.push_back(static_cast<int>(result.faces.size()));
    const std::vector<int>& face = mesh.faces[f];
    const std::vector<Corners> triangles = split_face(mesh, f);
    refuse_if(triangles.empty(),
              "face {}: a polygon of {} corners that cannot be split into triangles, expected a simple one",
              mesh.id_of_face(static_cast<int>(f)), face.size());
    for (const auto& [a, b, c] : triangles) {
      result.faces.push_back({face[a], face[b], face[c]});
      if (!mesh.uv.empty()) {
        result.uv.push_back({mesh.uv[f][a], mesh.uv[f][b], mesh.uv[f][c]});
      }
      for (const auto& [name, values] : mesh.face_fields) {
        result.face_fields[name].push_back(values[f]);
      }
    }
  }
  first_triangle.push_back(static_cast<int>(result.faces.size()));
  for (const auto& [name, faces] : mesh.face_groups) {
    std::vector<int>& triangles = result.face_groups[name];
    for (const int face : faces) {
      for (int triangle = first_triangle[face]; triangle < first_triangle[face + 1]; ++triangle) {
        triangles.push_back(triangle);
      }
    }
  }
  return result;
}

double enclosed_volume(const SurfaceMesh& mesh) {
  const SurfaceMesh triangles = triangulated(mesh);
  const Eigen::Vector3d& origin = mesh.points.front();  // near the mesh, so that little cancels
  double volume = 0;
  for (std::size_t f = 0; f < triangles.faces.size(); ++f) {
    volume += geometry::enclosed_volume(triangles.corner(f, 0) - origin, triangles.corner(f, 1) - origin,
                                        triangles.corner(f, 2) - origin);
  }
  return volume;
}

}  // namespace pellicle::meshing
