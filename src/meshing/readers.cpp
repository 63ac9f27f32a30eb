#include "meshing/readers.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>

#include "base/error.h"
#include "base/memory.h"
#include "meshing/format_readers.h"
#include "meshing/mesh_check.h"
#include "options/spelling.h"

namespace pellicle {
inline namespace meshing {

namespace {

/// Checks the result of a reader.
void check_numbers(const SurfaceMesh& mesh, const std::string& path) {
  if (mesh.points.empty() || mesh.faces.empty()) {
    throw Error(path + ": " + std::to_string(mesh.points.size()) + " points and " + std::to_string(mesh.faces.size()) +
                " polygons, expected a surface mesh");
  }
  require_coordinates(mesh, path);
  const int points = static_cast<int>(mesh.points.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (mesh.faces[f].size() < 3) {
      throw Error(path + ": face " + std::to_string(f) + " has " + std::to_string(mesh.faces[f].size()) +
                  " corners, expected at least 3");
    }
    for (const int point : mesh.faces[f]) {
      if (point < 0 || point >= points) {
        throw Error(path + ": face " + std::to_string(f) + " names point " + std::to_string(point) +
                    ", expected a number from 0 to " + std::to_string(points - 1));
      }
    }
  }
  for (std::size_t f = 0; f < mesh.uv.size(); ++f) {
    for (const Eigen::Vector2d& uv : mesh.uv[f]) {
      if (!uv.allFinite()) {
        throw Error(path + ": face " + std::to_string(f) + " has a texture coordinate that is not finite");
      }
    }
  }
}

/// Texture coordinates at some corners only are as good as none.
void drop_partial_uv(SurfaceMesh& mesh) {
  std::size_t whole = 0;
  bool has_some = false;
  for (std::size_t f = 0; f < mesh.uv.size(); ++f) {
    whole += mesh.uv[f].size() == mesh.faces[f].size() ? 1 : 0;
    has_some = has_some || !mesh.uv[f].empty();
  }
  if (whole == mesh.faces.size()) {
    return;
  }
  mesh.uv.clear();
  if (has_some) {
    mesh.remarks.push_back("texture coordinates are left out: " + std::to_string(whole) + " of " +
                           std::to_string(mesh.faces.size()) + " faces have them at every corner, expected all");
  }
}

}  // namespace

void sort_groups(SurfaceMesh& mesh) {
  for (auto* groups : {&mesh.groups, &mesh.face_groups}) {
    for (auto& entry : *groups) {
      std::vector<int>& members = entry.second;
      std::sort(members.begin(), members.end());
      members.erase(std::unique(members.begin(), members.end()), members.end());
    }
  }
}

void add_strip(SurfaceMesh& mesh, const std::vector<int>& strip) {
  for (std::size_t k = 2; k < strip.size(); ++k) {
    const std::size_t turned = k % 2;
    const int a = strip[k - 2 + turned];
    const int b = strip[k - 1 - turned];
    if (a != b && b != strip[k] && strip[k] != a) {
      mesh.faces.push_back({a, b, strip[k]});
    }
  }
}

void LeftOut::say(SurfaceMesh& mesh) const {
  const auto add = [&mesh](int count, const std::string& what, const std::string& left) {
    if (count > 0) {
      mesh.remarks.push_back(std::to_string(count) + " " + what + (count == 1 ? "" : "s") + left);
    }
  };
  add(volumes, "volume element", " left out: only faces are taken");
  add(higher_order, "face", " of second or higher order: only the corners are taken, sides become straight");
}

std::vector<std::vector<Eigen::Vector2d>> uv_of_corners(const SurfaceMesh& mesh,
                                                        const std::vector<Eigen::Vector2d>& uv_of_points) {
  std::vector<std::vector<Eigen::Vector2d>> uv;
  for (const std::vector<int>& face : mesh.faces) {
    std::vector<Eigen::Vector2d>& corners = uv.emplace_back();
    for (const int point : face) {
      if (point >= 0 && static_cast<std::size_t>(point) < uv_of_points.size()) {
        corners.push_back(uv_of_points[point]);
      }
    }
  }
  return uv;
}

SurfaceMesh read_mesh(const std::string& path) {
  static const std::map<std::string, SurfaceMesh (*)(const std::string&)> readers{
      {".obj", read_obj}, {".off", read_off}, {".ply", read_ply}, {".stl", read_stl},
      {".vtp", read_vtp}, {".vtu", read_vtu}, {".vtk", read_vtk}, {".msh", read_gmsh}};
  const std::string ending = in_lower_case(std::filesystem::path(path).extension().string());
  const auto reader = readers.find(ending);
  if (reader == readers.end()) {
    std::string known;
    for (const auto& entry : readers) {
      known += " " + entry.first;
    }
    throw Error(path + ": unknown ending '" + ending + "', expected one of" + known);
  }
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    throw Error(path + ": no such file");
  }
  // A face takes more bytes in memory than in any of the files.
  constexpr double bytes_of_a_byte = 3;
  const auto size = static_cast<double>(std::filesystem::file_size(path, ignored));
  require_memory(path + ": a mesh of " + std::to_string(size / 1e9) + " GB", bytes_of_a_byte * size);
  SurfaceMesh mesh = reader->second(path);
  check_numbers(mesh, path);
  drop_partial_uv(mesh);
  return mesh;
}

}  // namespace meshing
}  // namespace pellicle
