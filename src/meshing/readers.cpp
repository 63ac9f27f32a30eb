#include "meshing/readers.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "base/error.h"
#include "base/memory.h"
#include "base/sorting.h"
#include "meshing/format_readers.h"
#include "meshing/mesh_check.h"
#include "options/spelling.h"

namespace pellicle::meshing {

namespace {

/// Checks the result of a reader.
void check_numbers(const SurfaceMesh& mesh, const std::string& path) {
  refuse_if(mesh.points.empty() || mesh.faces.empty(), "{}: {} points and {} polygons, expected a surface mesh", path,
            mesh.points.size(), mesh.faces.size());
  require_coordinates(mesh, path);
  const int points = static_cast<int>(mesh.points.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    refuse_if(mesh.faces[f].size() < 3, "{}: face {} has {} corners, expected at least 3", path, f,
              mesh.faces[f].size());
    for (const int point : mesh.faces[f]) {
      refuse_if(point < 0 || point >= points, "{}: face {} names point {}, expected a number from 0 to {}", path, f,
                point, points - 1);
    }
  }
  for (std::size_t f = 0; f < mesh.uv.size(); ++f) {
    for (const Eigen::Vector2d& uv : mesh.uv[f]) {
      refuse_if(!uv.allFinite(), "{}: face {} has a texture coordinate that is not finite", path, f);
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
    mesh.remarks.push_back(
        fmt::format("texture coordinates are left out: {} of {} faces have them at every corner, expected all", whole,
                    mesh.faces.size()));
  }
}

}  // namespace

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
  const auto add = [&mesh](int count, const char* what, const char* left) {
    if (count > 0) {
      mesh.remarks.push_back(fmt::format("{} {}{}{}", count, what, count == 1 ? "" : "s", left));
    }
  };
  add(volumes, "volume element", " left out: only faces are taken");
  add(higher_order, "face", " of second or higher order: only the corners are taken, sides become straight");
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
    throw Error(fmt::format("{}: unknown ending '{}', expected one of{}", path, ending, known));
  }
  std::error_code ignored;
  refuse_if(!std::filesystem::is_regular_file(path, ignored), "{}: no such file", path);
  // A face takes more bytes in memory than in any of the files.
  constexpr double bytes_of_a_byte = 3;
  const auto size = static_cast<double>(std::filesystem::file_size(path, ignored));
  require_memory(fmt::format("{}: a mesh of {:f} GB", path, size / 1e9), bytes_of_a_byte * size);
  SurfaceMesh mesh = reader->second(path);
  for (auto* groups : {&mesh.groups, &mesh.face_groups}) {
    for (auto& entry : *groups) {
      entry.second = without_repeats(std::move(entry.second));
    }
  }
  check_numbers(mesh, path);
  drop_partial_uv(mesh);
  return mesh;
}

}  // namespace pellicle::meshing
