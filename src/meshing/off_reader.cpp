#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "meshing/format_readers.h"
#include "meshing/text_file.h"

namespace pellicle::meshing {

namespace {

/// The numbers that the lines of points have behind the coordinates: normals (N), colours (C) and texture coordinates
/// (ST) come in this order.
struct BehindPoints {
  bool has_texture = false;
  std::vector<std::size_t> counts{0};  ///< that are possible; behind the first point the one that it has
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
      file.fail(fmt::format("header '{}', expected OFF, or C, N and ST before it: points of three coordinates",
                            file.words().front()));
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
    file.fail(fmt::format("point {} has {} numbers, expected {}", point, 3 + count, expected));
  };
  if (point == 0) {
    if (std::find(behind.counts.begin(), behind.counts.end(), count) == behind.counts.end()) {
      fail("3 coordinates, and behind them the normal and the colour that the header announces");
    }
    behind.counts = {count};
  } else if (count != behind.counts.front()) {
    fail(fmt::format("{} as point 0 has", 3 + behind.counts.front()));
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
  TextFile file(path, /*comments=*/true);
  const std::string_view header = file.next_word("the header OFF");
  const std::size_t off = header.find("OFF");
  file.refuse_if(off == std::string_view::npos, "header '{}', expected OFF", header);
  BehindPoints behind = behind_points(file, header.substr(0, off));
  const std::string_view joined = header.substr(off + 3);  // the first count, in files of collections in wide use
  const std::string_view first = joined.empty() ? file.next_word("the number of points") : joined;
  file.refuse_if(first == "BINARY", "a binary file, expected OFF as text");
  // A point takes at least "0 0 0" and a blank, a face "3 0 1 2" and one.
  const int points = file.count(first, "the number of points", 6);
  const int faces = file.next_count("the number of faces", 8);
  file.next_integer("the number of edges");

  SurfaceMesh mesh;
  std::vector<Eigen::Vector2d> uv_of_points;
  for (int i = 0; i < points; ++i) {
    mesh.points.push_back(file.next_point());
    if (const std::optional<Eigen::Vector2d> uv = read_behind(file, behind, i)) {
      uv_of_points.push_back(*uv);
    }
  }
  for (int f = 0; f < faces; ++f) {
    const int corners = file.integer(file.next_word("the corners of a face"), "the number of corners");
    file.refuse_if(corners < 3, "face {} has {} corners, expected at least 3", f, corners);
    std::vector<int>& face = mesh.faces.emplace_back();
    for (int corner = 0; corner < corners; ++corner) {
      const int point = file.next_integer("a point number");
      file.refuse_if(point < 0 || point >= points, "point number {} in face {}, expected one from 0 to {}", point, f,
                     points - 1);
      face.push_back(point);
    }
    file.skip_line();
  }
  if (file.next_line()) {
    file.fail(fmt::format("'{}' after the last face, expected the end of the file", file.words().front()));
  }
  if (!uv_of_points.empty()) {
    mesh.uv = uv_of_corners(mesh, uv_of_points);
  }
  return mesh;
}

}  // namespace pellicle::meshing
