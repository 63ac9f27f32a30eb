#include "base/error.h"
#include "meshing/format_readers.h"
#include "meshing/text_file.h"

namespace pellicle {
inline namespace meshing {

// OFF: the word OFF, three counts (points, faces, edges), the points, the faces as a count and point numbers.
// Numbers may be broken over lines; what follows a face on its line is its colour.
SurfaceMesh read_off(const std::string& path) {
  TextFile file(path, {/*comments=*/true, /*continuations=*/false});
  const std::string_view header = file.next_word("the header OFF");
  if (header != "OFF") {
    file.fail("header '" + std::string(header) + "', expected OFF");
  }
  // A point takes at least "0 0 0" and a blank, a face "3 0 1 2" and one.
  const int points = file.count(file.next_word("the number of points"), "the number of points", 6);
  const int faces = file.count(file.next_word("the number of faces"), "the number of faces", 8);
  file.integer(file.next_word("the number of edges"), "the number of edges");

  SurfaceMesh mesh;
  for (int i = 0; i < points; ++i) {
    Eigen::Vector3d& point = mesh.points.emplace_back();
    for (double& coordinate : point) {
      coordinate = file.number(file.next_word("a coordinate"), "a coordinate");
    }
    if (file.words_left() != 0) {
      file.fail("point " + std::to_string(i) + " has more than 3 coordinates");
    }
  }
  for (int f = 0; f < faces; ++f) {
    const int corners = file.integer(file.next_word("the corners of a face"), "the number of corners");
    if (corners < 3) {
      file.fail("face " + std::to_string(f) + " has " + std::to_string(corners) + " corners, expected at least 3");
    }
    std::vector<int>& face = mesh.faces.emplace_back();
    for (int corner = 0; corner < corners; ++corner) {
      const int point = file.integer(file.next_word("a point number"), "a point number");
      if (point < 0 || point >= points) {
        file.fail("point number " + std::to_string(point) + " in face " + std::to_string(f) +
                  ", expected one from 0 to " + std::to_string(points - 1));
      }
      face.push_back(point);
    }
    file.skip_line();
  }
  if (file.next_line()) {
    file.fail("'" + std::string(file.words().front()) + "' after the last face, expected the end of the file");
  }
  return mesh;
}

}  // namespace meshing
}  // namespace pellicle
