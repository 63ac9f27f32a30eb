#include "meshing/surface_mesh.h"

#include <fmt/format.h>
#include <petscsys.h>

#include <algorithm>

#include "base/error.h"
#include "base/memory.h"

namespace pellicle {
inline namespace meshing {

void require_mesh_size(const std::string& what, double faces) {
  // A quad brings a vertex, ten springs and four triangles, which are numbered over all ranks.
  constexpr double most_faces = PETSC_MAX_INT / 16;
  if (!(faces <= most_faces)) {
    throw Error(fmt::format("{}: {:g} faces, expected at most {:g}", what, faces, most_faces));
  }
  // What a face takes at least until the mesh is distributed (measured: triangles 630, quads 1500 bytes). A run takes
  // several times as much, spread over the ranks.
  constexpr double bytes_of_a_face = 600;
  require_memory(what, bytes_of_a_face * faces);
}

std::vector<std::vector<Eigen::Vector2d>> uv_of_corners(const SurfaceMesh& mesh,
                                                        const std::vector<Eigen::Vector2d>& uv_of_points) {
  std::vector<std::vector<Eigen::Vector2d>> uv;
  for (const std::vector<int>& face : mesh.faces) {
    std::vector<Eigen::Vector2d>& corners = uv.emplace_back();
    corners.reserve(face.size());
    for (const int point : face) {
      if (point >= 0 && static_cast<std::size_t>(point) < uv_of_points.size()) {
        corners.push_back(uv_of_points[point]);
      }
    }
  }
  return uv;
}

void sort_members(std::vector<int>& members) {
  std::sort(members.begin(), members.end());
  members.erase(std::unique(members.begin(), members.end()), members.end());
}

void renumber(std::map<std::string, std::vector<int>>& groups, const std::vector<int>& target) {
  for (auto& entry : groups) {
    std::vector<int> members;
    for (const int member : entry.second) {
      if (target[member] >= 0) {
        members.push_back(target[member]);
      }
    }
    sort_members(members);
    entry.second = std::move(members);
  }
}

void renumber_points(SurfaceMesh& mesh, const std::vector<int>& target) {
  const int kept = 1 + *std::max_element(target.begin(), target.end());
  std::vector<Eigen::Vector3d> points(kept);
  std::vector<int> ids(kept);
  for (std::size_t i = target.size(); i-- > 0;) {
    if (target[i] >= 0) {
      points[target[i]] = mesh.points[i];
      ids[target[i]] = mesh.id_of_point(static_cast<int>(i));
    }
  }
  mesh.points = std::move(points);
  mesh.point_id = std::move(ids);
  for (std::vector<int>& face : mesh.faces) {
    for (int& point : face) {
      point = target[point];
    }
  }
  renumber(mesh.groups, target);
}

}  // namespace meshing
}  // namespace pellicle
