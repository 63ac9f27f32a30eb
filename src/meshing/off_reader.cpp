#include <algorithm>
#include <optional>

#include "base/error.h"
#include "meshing/format_readers.h"
#include "meshing/text_file.h"

namespace pellicle {
inline namespace meshing {

namespace {

/// The numbers that the lines of points have behind the coordinates: normals (N), colours (C) and texture coordinates
/// (ST) come in this order.
struct BehindPoints {
  bool has_texture = false;
  std::vector<std::size_t> counts{0};  ///< that are possible
  std::optional<std::size_t> count;    ///< that the first point has, and so all have
};

/// @param prefixes of the word OFF; without any points may all the same have a normal, a colour, or both
BehindPoints behind_points(const TextFile& file, std::string_view prefixes) {
  const bool is_plain = prefixes.empty();
  bool has_colour = false;
  std::size_t others = 0;
  BehindPoints behind;
  const auto take = [&prefixes](std::string_view prefix) {
    const bool begins = prefixes.substr(0, prefix.size()) == prefix;
    prefixes.remove_prefix(begins ? prefix.size() : 0);
    return begins;
  };
  while (!prefixes.empty()) {
    if (take("ST")) {
      behind.has_texture = true;
      others += 2;
    } else if (take("C")) {
      has_colour = true;
    } else if (take("N")) {
      others += 3;
    } else {
      file.fail("header '" + std::string(file.words().front()) +
                "', expected OFF, or C, N and ST before it: points of three coordinates");
    }
  }
  behind.counts.push_back(others);
  if (has_colour || is_plain) {
    behind.counts.insert(behind.counts.end(), {others + 3, others + 4});
  }
  if (is_plain) {
    behind.counts.insert(behind.counts.end(), {3 + 3, 3 + 4});
  }
  return behind;
}

/// Takes the rest of a point's line. @returns its texture coordinates, if it has any
std::optional<Eigen::Vector2d> read_behind(TextFile& file, BehindPoints& behind, int point) {
  const std::size_t count = file.words_left();
  const auto fail = [&](const std::string& expected) {
    file.fail("point " + std::to_string(point) + " has " + std::to_string(3 + count) + " numbers, expected " +
              expected);
  };
  if (!behind.count) {
    if (std::find(behind.counts.begin(), behind.counts.end(), count) == behind.counts.end()) {
      fail("3 coordinates, and behind them the normal and the colour that the header announces");
    }
    behind.count = count;
  } else if (count != *behind.count) {
    fail(std::to_string(3 + *behind.count) + " as point 0 has");
  }
  if (!behind.has_texture || count == 0) {
    file.skip_line();
    return std::nullopt;
  }
  const auto last = file.words().end();
  file.skip_line();
  return Eigen::Vector2d(file.number(*(last - 2), "a texture coordinate"),
                         file.number(*(last - 1), "a texture coordinate"));
}

}  // namespace

// OFF: the word OFF with its prefixes, three counts (points, faces, edges), the points, the faces as a count and point
// numbers. Numbers may be broken over lines; what follows a face on its line is its colour.
SurfaceMesh read_off(const std::string& path) {
  TextFile file(path, {/*comments=*/true, {}});
  const std::string_view header = file.next_word("the header OFF");
  const std::size_t off = header.find("OFF");
  if (off == std::string_view::npos) {
    file.fail("header '" + std::string(header) + "', expected OFF");
  }
  BehindPoints behind = behind_points(file, header.substr(0, off));
  const std::string_view joined = header.substr(off + 3);  // the first count, in files of collections in wide use
  const std::string_view first = joined.empty() ? file.next_word("the number of points") : joined;
  if (first == "BINARY") {
    file.fail("a binary file, expected OFF as text");
  }
  // A point takes at least "0 0 0" and a blank, a face "3 0 1 2" and one.
  const int points = file.count(first, "the number of points", 6);
  const int faces = file.count(file.next_word("the number of faces"), "the number of faces", 8);
  file.integer(file.next_word("the number of edges"), "the number of edges");

  SurfaceMesh mesh;
  std::vector<Eigen::Vector2d> uv_of_points;
  for (int i = 0; i < points; ++i) {
    Eigen::Vector3d& point = mesh.points.emplace_back();
    for (double& coordinate : point) {
      coordinate = file.number(file.next_word("a coordinate"), "a coordinate");
    }
    if (const std::optional<Eigen::Vector2d> uv = read_behind(file, behind, i)) {
      uv_of_points.push_back(*uv);
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
  if (!uv_of_points.empty()) {
    mesh.uv = uv_of_corners(mesh, uv_of_points);
  }
  return mesh;
}

}  // namespace meshing
}  // namespace pellicle
