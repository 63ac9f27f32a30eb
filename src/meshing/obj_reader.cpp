#include <fmt/format.h>

#include <set>
#include <utility>

#include "meshing/format_readers.h"
#include "meshing/text_file.h"

namespace pellicle::meshing {

namespace {

/// Turns a number of an OBJ file (from 1, or from the end if negative) into one from 0.
int resolve(const TextFile& file, std::string_view word, std::size_t count, const char* what) {
  const int number = file.integer(word, what);
  const int items = static_cast<int>(count);
  const int index = number > 0 ? number - 1 : items + number;
  file.refuse_if(number == 0 || index < 0 || index >= items, "{} {}, expected one from 1 to {}", what, number, items);
  return index;
}

}  // namespace

// Point and texture numbers of a face may only refer to lines above it.
SurfaceMesh read_obj(const std::string& path) {
  // Of these only v, vt, f and g are read: normals, materials, smoothing and all that is no surface is ignored.
  static const std::set<std::string_view> keywords{
      "v",      "vt",    "f",   "g",  "vn", "o", "s",        "mtllib",   "usemtl",     "usemap",
      "maplib", "bevel", "lod", "mg", "l",  "p", "c_interp", "d_interp", "shadow_obj", "trace_obj"};
  SurfaceMesh mesh;
  std::vector<Eigen::Vector2d> textures;
  std::vector<std::string> names;                                         // of the groups of the faces that follow
  std::vector<std::pair<std::vector<int>*, std::vector<int>*>> of_group;  // their points and faces, once one has
  TextFile file(path, /*comments=*/true, keywords);
  while (file.next_line()) {
    const std::vector<std::string_view>& words = file.words();
    const std::string_view keyword = words.front();
    if (keyword == "v") {
      // x y z, then a weight or a colour, which is ignored.
      file.refuse_if(words.size() < 4 || words.size() > 8, "{} coordinates, expected 3", words.size() - 1);
      mesh.points.emplace_back(file.number(words[1], "a coordinate"), file.number(words[2], "a coordinate"),
                               file.number(words[3], "a coordinate"));
    } else if (keyword == "vt") {
      file.refuse_if(words.size() < 2, "no texture coordinates, expected 1 to 3");
      textures.emplace_back(file.number(words[1], "a texture coordinate"),
                            words.size() > 2 ? file.number(words[2], "a texture coordinate") : 0);
    } else if (keyword == "f") {
      std::vector<int> face;
      std::vector<Eigen::Vector2d> uv;
      for (std::size_t corner = 1; corner < words.size(); ++corner) {
        // point, point/texture, point//normal or point/texture/normal
        const std::string_view word = words[corner];
        const std::size_t slash = word.find('/');
        face.push_back(resolve(file, word.substr(0, slash), mesh.points.size(), "point number"));
        if (slash != std::string_view::npos) {
          const std::string_view rest = word.substr(slash + 1);
          const std::string_view texture = rest.substr(0, rest.find('/'));
          if (!texture.empty()) {
            uv.push_back(textures[resolve(file, texture, textures.size(), "texture number")]);
          }
        }
      }
      file.refuse_if(face.size() < 3, "a face of {} corners, expected at least 3", face.size());
      for (const std::string& name : names) {
        of_group.emplace_back(&mesh.groups[name], &mesh.face_groups[name]);
      }
      names.clear();
      for (const auto& [points, faces] : of_group) {
        points->insert(points->end(), face.begin(), face.end());
        faces->push_back(static_cast<int>(mesh.faces.size()));
      }
      mesh.faces.push_back(std::move(face));
      mesh.uv.push_back(std::move(uv));
    } else if (keyword == "g") {
      // A name given twice counts once; very many are no list of names, and each takes memory for every face.
      const std::set<std::string_view> different(words.begin() + 1, words.end());
      file.refuse_if(different.size() > most_groups, "{} groups for one face, expected at most {}", different.size(),
                     most_groups);
      names.assign(different.begin(), different.end());
      of_group.clear();
    } else if (keywords.count(keyword) == 0) {
      file.fail(fmt::format("keyword '{}', expected v, vt, f or g", keyword));
    }
  }
  return mesh;
}

}  // namespace pellicle::meshing
