#include <array>
#include <cstdint>
#include <cstring>

#include "base/error.h"
#include "meshing/format_readers.h"
#include "meshing/mesh_check.h"
#include "meshing/text_file.h"
#include "options/spelling.h"

namespace pellicle::meshing {

namespace {

/// Adds the facet of the last three points.
void add_facet(SurfaceMesh& mesh) {
  const auto end = static_cast<int>(mesh.points.size());
  mesh.faces.push_back({end - 3, end - 2, end - 1});
}

/// Binary: 80 bytes of text, the number of facets, and of each its normal, three corners and two bytes. Numbers are
/// little-endian.
SurfaceMesh read_binary(const std::string& path, const std::string& content) {
  constexpr std::size_t head = 84;
  constexpr std::size_t of_facet = 50;
  constexpr std::size_t of_normal = 12;
  std::uint32_t facets = 0;
  if (content.size() >= head) {
    std::memcpy(&facets, content.data() + 80, sizeof facets);
  }
  const std::size_t expected = head + of_facet * static_cast<std::size_t>(facets);
  refuse_if(content.size() < expected, "{}: {} bytes, expected {} for {} facets", path, content.size(), expected,
            facets);
  SurfaceMesh mesh;
  for (std::size_t begin = head; begin < expected; begin += of_facet) {
    std::array<float, 9> numbers{};
    std::memcpy(numbers.data(), content.data() + begin + of_normal, sizeof numbers);
    for (std::size_t k = 0; k < 3; ++k) {
      mesh.points.emplace_back(Eigen::Map<const Eigen::Vector3f>(numbers.data() + 3 * k).cast<double>());
    }
    add_facet(mesh);
  }
  return mesh;
}

/// Text: between `solid` and `endsolid`, whose lines end with a name, facets of three corners. Keywords may be in
/// capitals; a file may hold several solids.
SurfaceMesh read_text(TextFile& file) {
  const auto expect = [&file](const char* keyword) {
    const std::string_view word = file.next_word(keyword);
    file.refuse_if(in_lower_case(word) != keyword, "'{}', expected {}", word, keyword);
  };
  const auto next = [&file] { return in_lower_case(file.next_word("facet or endsolid")); };
  SurfaceMesh mesh;
  do {
    expect("solid");
    file.skip_line();
    for (std::string word = next(); word != "endsolid"; word = next()) {
      file.refuse_if(word != "facet", "'{}', expected facet or endsolid", word);
      while (in_lower_case(file.next_word("outer loop")) != "outer") {  // The normal follows from the corners.
      }
      expect("loop");
      for (int k = 0; k < 3; ++k) {
        expect("vertex");
        mesh.points.push_back(file.next_point());
      }
      expect("endloop");
      expect("endfacet");
      add_facet(mesh);
    }
    file.skip_line();
  } while (file.next_line());
  return mesh;
}

}  // namespace

// VTK's reader keeps single precision, and takes lines of more than 255 letters for several.
SurfaceMesh read_stl(const std::string& path) {
  TextFile file(path);
  const bool is_text = file.content().find('\0') == std::string::npos;
  SurfaceMesh mesh = is_text ? read_text(file) : read_binary(path, file.content());
  require_coordinates(mesh, path);  // Equal points are found by sorting.
  weld(mesh);
  mesh.point_id.clear();
  return mesh;
}

}  // namespace pellicle::meshing
