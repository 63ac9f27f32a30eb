#include "meshing/mesh_check.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <tuple>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/sorting.h"
#include "geometry/pi.h"
#include "meshing/triangulation.h"

namespace pellicle::meshing {

namespace {

/// Relative to the square of a face's longest edge: areas below are rounding errors.
constexpr double area_tolerance = 1e-12;

constexpr double degrees = 180 / pi;

/// One side of a face.
struct Side {
  int low;  ///< its points, the lower number first
  int high;
  int face;
  int corner;    ///< corner of the face at which the side begins
  bool forward;  ///< whether it begins at `low`
};

/// The sides of one edge: a range of the sorted sides.
struct Edge {
  std::vector<Side>::const_iterator begin;
  std::vector<Side>::const_iterator end;
  std::ptrdiff_t faces() const { return end - begin; }
};

std::vector<Side> sorted_sides(const SurfaceMesh& mesh) {
  std::vector<Side> sides;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const std::vector<int>& face = mesh.faces[f];
    for (std::size_t k = 0; k < face.size(); ++k) {
      const auto [low, high] = std::minmax(face[k], face[(k + 1) % face.size()]);
      sides.push_back({low, high, static_cast<int>(f), static_cast<int>(k), face[k] == low});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::array{a.low, a.high, a.face, a.corner} < std::array{b.low, b.high, b.face, b.corner};
  });
  return sides;
}

std::vector<Edge> edges_of(const std::vector<Side>& sides) {
  std::vector<Edge> edges;
  for (auto begin = sides.begin(); begin != sides.end();) {
    const auto end = std::find_if(
        begin, sides.end(), [&begin](const Side& side) { return side.low != begin->low || side.high != begin->high; });
    edges.push_back({begin, end});
    begin = end;
  }
  return edges;
}

/// Removes corners that repeat the corner before them, and faces of which fewer than three corners are left. @returns
/// how many faces were removed.
int remove_collapsed_faces(SurfaceMesh& mesh) {
  std::vector<int> stands = numbers_up_to(mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    std::vector<int>& face = mesh.faces[f];
    const std::size_t corners = face.size();
    const int first = face.front();
    std::size_t kept = 0;
    for (std::size_t k = 0; k < corners; ++k) {
      if (face[k] != (k + 1 < corners ? face[k + 1] : first)) {
        face[kept] = face[k];
        if (!mesh.uv.empty()) {
          mesh.uv[f][kept] = mesh.uv[f][k];
        }
        ++kept;
      }
    }
    face.resize(kept);
    if (!mesh.uv.empty()) {
      mesh.uv[f].resize(kept);
    }
    if (kept < 3) {
      stands[f] = -1;
    }
  }
  return keep_faces(mesh, stands);
}

/// Removes faces that repeat an earlier one's points in the same or the reverse order. @returns how many.
int remove_repeated_faces(SurfaceMesh& mesh) {
  std::vector<std::vector<int>> forms = mesh.faces;
  for (std::vector<int>& face : forms) {
    // Puts all into one form: from the lowest point number towards its lower neighbour.
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
    if (face.back() < face[1]) {
      std::reverse(face.begin() + 1, face.end());
    }
  }
  std::vector<int> order = numbers_up_to(forms.size());
  std::sort(order.begin(), order.end(),
            [&forms](int f, int g) { return std::tie(forms[f], f) < std::tie(forms[g], g); });
  std::vector<int> stands = numbers_up_to(forms.size());
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (forms[order[k]] == forms[order[k - 1]]) {
      stands[order[k]] = stands[order[k - 1]];
    }
  }
  return keep_faces(mesh, stands);
}

int remove_unused_points(SurfaceMesh& mesh) {
  std::vector<int> stands(mesh.points.size(), -1);
  for (const std::vector<int>& face : mesh.faces) {
    for (const int point : face) {
      stands[point] = point;
    }
  }
  return keep_points(mesh, stands);
}

/// Six times the sum of the volumes between the first point and the fan of each face of a piece, and its scale, to
/// judge what counts as no volume. @param turn 1 for faces as they are, -1 for those that count the other way round
std::array<double, 2> six_volumes(const SurfaceMesh& mesh, const std::vector<int>& piece,
                                  const std::vector<int>& turn) {
  double sum = 0;
  double area = 0;
  const Eigen::Vector3d origin = mesh.corner(piece.front(), 0);
  for (const int face : piece) {
    const Eigen::Vector3d first = mesh.corner(face, 0) - origin;
    for (std::size_t k = 2; k < mesh.faces[face].size(); ++k) {
      const Eigen::Vector3d second = mesh.corner(face, k - 1) - origin;
      const Eigen::Vector3d third = mesh.corner(face, k) - origin;
      sum += turn[face] * first.dot(second.cross(third));
      area += (second - first).cross(third - first).norm();
    }
  }
  return {sum, area * std::sqrt(area)};
}

/// Flips faces that disagree with their neighbours over edges of two faces: in each open piece the smaller part, in
/// each closed one the part that faces inward. @returns how many were flipped; faces with contradictory neighbours go
/// to `twisted`.
int orient(SurfaceMesh& mesh, const std::vector<Edge>& edges, std::vector<int>& twisted) {
  struct Neighbour {
    int face;
    int agrees;  ///< 1, or -1 if one of the two must be flipped
  };
  std::vector<std::vector<Neighbour>> neighbours(mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    neighbours[f].reserve(mesh.faces[f].size());
  }
  for (const Edge& edge : edges) {
    if (edge.faces() == 2) {
      const Side& first = edge.begin[0];
      const Side& second = edge.begin[1];
      const int agrees = first.forward != second.forward ? 1 : -1;
      neighbours[first.face].push_back({second.face, agrees});
      neighbours[second.face].push_back({first.face, agrees});
    }
  }
  std::vector<int> turn(mesh.faces.size(), 0);  // 1: as it is; -1: flipped; 0: not seen
  int flipped = 0;
  for (std::size_t seed = 0; seed < mesh.faces.size(); ++seed) {
    if (turn[seed] != 0) {
      continue;
    }
    turn[seed] = 1;
    std::vector<int> piece{static_cast<int>(seed)};
    bool contradiction = false;
    for (std::size_t next = 0; next < piece.size(); ++next) {
      for (const Neighbour& neighbour : neighbours[piece[next]]) {
        const int wanted = neighbour.agrees * turn[piece[next]];
        int& there = turn[neighbour.face];
        if (there == 0) {
          there = wanted;
          piece.push_back(neighbour.face);
        } else if (there != wanted && !contradiction) {
          contradiction = true;
          twisted.push_back(neighbour.face);
        }
      }
    }
    if (contradiction) {
      continue;
    }
    const auto flips = std::count_if(piece.begin(), piece.end(), [&turn](int f) { return turn[f] < 0; });
    int wrong = 2 * flips > static_cast<std::ptrdiff_t>(piece.size()) ? 1 : -1;
    const bool closed =
        std::all_of(piece.begin(), piece.end(), [&](int f) { return neighbours[f].size() == mesh.faces[f].size(); });
    if (closed) {
      constexpr double flat = 1e-9;  // two layers that lie on each other enclose nothing
      const auto [volume, scale] = six_volumes(mesh, piece, turn);
      if (std::abs(volume) > flat * scale) {
        wrong = volume < 0 ? 1 : -1;
      }
    }
    for (const int f : piece) {
      if (turn[f] == wrong) {
        std::reverse(mesh.faces[f].begin() + 1, mesh.faces[f].end());
        if (!mesh.uv.empty()) {
          std::reverse(mesh.uv[f].begin() + 1, mesh.uv[f].end());
        }
        ++flipped;
      }
    }
  }
  return flipped;
}

/// The first few of a list, as words.
template <class Item>
std::string first_of(const std::vector<Item>& items) {
  const auto end = items.begin() + std::min<std::ptrdiff_t>(items.size(), 5);
  return fmt::format("{}{}", fmt::join(items.begin(), end, ", "), end == items.end() ? "" : ", ...");
}

/// The numbers in the file of points or faces. @param ids SurfaceMesh::point_id or face_id
std::vector<int> in_file(std::vector<int> numbers, const std::vector<int>& ids) {
  if (!ids.empty()) {
    std::transform(numbers.begin(), numbers.end(), numbers.begin(), [&ids](int number) { return ids[number]; });
  }
  return numbers;
}

/// Faces that name a point twice or have no area, and quads with corners turned against the others.
void find_bad_faces(const SurfaceMesh& mesh, std::vector<int>& degenerate, std::vector<int>& inverted) {
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    std::vector<int> face = mesh.faces[f];
    const std::size_t corners = face.size();
    std::sort(face.begin(), face.end());
    if (std::adjacent_find(face.begin(), face.end()) != face.end()) {
      degenerate.push_back(static_cast<int>(f));
      continue;
    }
    double longest = 0;
    double largest = 0;
    std::vector<Eigen::Vector3d> normals;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < corners; ++k) {
      const Eigen::Vector3d ahead = mesh.corner(f, k + 1) - mesh.corner(f, k);
      const Eigen::Vector3d back = mesh.corner(f, k + corners - 1) - mesh.corner(f, k);
      longest = std::max(longest, ahead.squaredNorm());
      normals.push_back(ahead.cross(back));
      largest = std::max(largest, normals.back().norm());
      mean += normals.back();
    }
    if (largest <= area_tolerance * longest) {
      degenerate.push_back(static_cast<int>(f));
      continue;
    }
    // A quad crossed over itself has corners that cancel; one with a corner inside the others has one against them.
    const bool against = std::any_of(normals.begin(), normals.end(), [&](const Eigen::Vector3d& normal) {
      return normal.dot(mean) < -area_tolerance * longest * mean.norm();
    });
    if (corners == 4 && (against || mean.norm() <= area_tolerance * longest)) {
      inverted.push_back(static_cast<int>(f));
    }
  }
}

/// Points whose faces form more than one fan: corners that share an edge at the point are united.
std::vector<int> find_split_points(const SurfaceMesh& mesh, const std::vector<Edge>& edges) {
  std::vector<std::size_t> first_corner;
  std::size_t corner_count = 0;
  for (const std::vector<int>& face : mesh.faces) {
    first_corner.push_back(corner_count);
    corner_count += face.size();
  }
  const auto corner_at = [&](const Side& side, bool low) {
    const std::size_t begin = side.corner;
    const std::size_t end = (begin + 1) % mesh.faces[side.face].size();
    return first_corner[side.face] + (side.forward == low ? begin : end);
  };
  DisjointSets fans(corner_count);
  for (const Edge& edge : edges) {
    for (auto side = edge.begin + 1; side < edge.end; ++side) {
      fans.unite(corner_at(*edge.begin, true), corner_at(*side, true));
      fans.unite(corner_at(*edge.begin, false), corner_at(*side, false));
    }
  }
  std::vector<int> fans_at(mesh.points.size(), 0);
  std::vector<int> split;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t k = 0; k < mesh.faces[f].size(); ++k) {
      const std::size_t corner = first_corner[f] + k;
      const int point = mesh.faces[f][k];
      if (fans.find(corner) == corner && ++fans_at[point] == 2) {
        split.push_back(point);
      }
    }
  }
  std::sort(split.begin(), split.end());
  return split;
}

/// The triangles of all faces that are not `degenerate`; those that cannot be split go to `crossed`.
std::vector<std::array<int, 3>> split_faces(const SurfaceMesh& mesh, const std::vector<int>& degenerate,
                                            std::vector<int>& crossed) {
  std::vector<std::array<int, 3>> triangles;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (std::binary_search(degenerate.begin(), degenerate.end(), static_cast<int>(f))) {
      continue;
    }
    const std::vector<std::array<std::size_t, 3>> split = split_face(mesh, f);
    if (split.empty()) {
      crossed.push_back(static_cast<int>(f));
    }
    for (const auto& [a, b, c] : split) {
      triangles.push_back({mesh.faces[f][a], mesh.faces[f][b], mesh.faces[f][c]});
    }
  }
  return triangles;
}

/// @throws Error if very many triangles meet at a point: the time of DMPlex grows with the square of their number.
void require_few_at_each_point(const SurfaceMesh& mesh, const std::vector<std::array<int, 3>>& triangles,
                               const std::string& name) {
  constexpr int most = 10000;
  std::vector<int> count(mesh.points.size(), 0);
  for (const std::array<int, 3>& triangle : triangles) {
    for (const int point : triangle) {
      ++count[point];
    }
  }
  const auto largest = std::max_element(count.begin(), count.end());
  refuse_if(*largest > most, "{}: {} triangles meet at point {}, expected at most {}", name, *largest,
            mesh.id_of_point(static_cast<int>(largest - count.begin())), most);
}

/// Counts of edges, boundary and pieces.
void count_topology(const SurfaceMesh& mesh, const std::vector<Edge>& edges, MeshReport& report) {
  report.points = static_cast<int>(mesh.points.size());
  report.faces = static_cast<int>(mesh.faces.size());
  report.edges = static_cast<int>(edges.size());
  for (const std::vector<int>& face : mesh.faces) {
    report.triangles += face.size() == 3 ? 1 : 0;
    report.quads += face.size() == 4 ? 1 : 0;
  }
  DisjointSets pieces(mesh.faces.size());
  DisjointSets loops(mesh.points.size());
  std::vector<int> valence(mesh.points.size(), 0);
  std::vector<bool> on_boundary(mesh.points.size(), false);
  for (const Edge& edge : edges) {
    const int low = edge.begin->low;
    const int high = edge.begin->high;
    ++valence[low];
    ++valence[high];
    for (auto side = edge.begin + 1; side < edge.end; ++side) {
      pieces.unite(edge.begin->face, side->face);
    }
    if (edge.faces() == 1) {
      ++report.boundary_edges;
      loops.unite(low, high);
      on_boundary[low] = on_boundary[high] = true;
    }
  }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    report.components += pieces.find(f) == f ? 1 : 0;
  }
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    report.boundary_loops += on_boundary[i] && loops.find(i) == i ? 1 : 0;
    ++report.valence[valence[i]];
  }
}

/// 2 r_in / r_out = 8 A^2 / (s a b c), s half the circumference.
double radius_ratio(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& r) {
  const double a = (q - p).norm();
  const double b = (r - q).norm();
  const double c = (p - r).norm();
  return 4 * (q - p).cross(r - p).squaredNorm() / ((a + b + c) * a * b * c);
}

void measure_quality(const SurfaceMesh& mesh, MeshReport& report) {
  double sum_of_ratios = 0;
  report.smallest_angle = pi;
  report.shortest_edge = (mesh.corner(0, 1) - mesh.corner(0, 0)).norm();
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const std::size_t corners = mesh.faces[f].size();
    Eigen::Vector3d twice_area = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < corners; ++k) {
      const Eigen::Vector3d ahead = mesh.corner(f, k + 1) - mesh.corner(f, k);
      const Eigen::Vector3d back = mesh.corner(f, k + corners - 1) - mesh.corner(f, k);
      const double angle = std::atan2(ahead.cross(back).norm(), ahead.dot(back));
      if (angle < report.smallest_angle) {
        report.smallest_angle = angle;
        report.sharpest_face = mesh.id_of_face(static_cast<int>(f));
      }
      report.shortest_edge = std::min(report.shortest_edge, ahead.norm());
      report.longest_edge = std::max(report.longest_edge, ahead.norm());
      const Eigen::Vector3d& origin = mesh.corner(f, 0);
      twice_area += (mesh.corner(f, k) - origin).cross(mesh.corner(f, k + 1) - origin);
    }
    report.area += 0.5 * twice_area.norm();
    if (corners == 3) {
      const double ratio = radius_ratio(mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2));
      report.smallest_radius_ratio = std::min(report.smallest_radius_ratio, ratio);
      sum_of_ratios += ratio;
    }
  }
  if (report.triangles > 0) {
    report.mean_radius_ratio = sum_of_ratios / report.triangles;
  }
}

/// "3 points were merged ...": each kind of repair that was needed.
std::vector<std::string> repairs(const MeshReport& report) {
  std::vector<std::string> texts;
  const auto add = [&texts](int count, const char* what, const char* how) {
    if (count > 0) {
      texts.push_back(fmt::format("{} {}{} {}", count, what, count == 1 ? "" : "s", how));
    }
  };
  add(report.merged_points, "duplicate point", "merged with others at the same place");
  add(report.removed_faces, "face", "removed that repeated another or had collapsed");
  add(report.removed_points, "point", "removed that no face used");
  add(report.flipped_faces, "face", "flipped to agree with the neighbours or to face outward");
  return texts;
}

}  // namespace

std::string MeshReport::size() const {
  return fmt::format("{} points, {} faces ({} quads, {} triangles), {} {}, {}{}", points, faces, quads, triangles,
                     components, components == 1 ? "piece" : "pieces",
                     boundary_edges == 0 ? "closed"
                                         : fmt::format("open, {} boundary edges in {} {}", boundary_edges,
                                                       boundary_loops, boundary_loops == 1 ? "loop" : "loops"),
                     boundary_edges == 0 && volume != 0 ? fmt::format(", encloses {:g} m^3", volume) : "");
}

std::string MeshReport::quality() const {
  std::string text =
      fmt::format("area {:.3g} m^2, edges {:.3g} to {:.3g} m (ratio {:.3g}), smallest angle {:.3g} deg, ", area,
                  shortest_edge, longest_edge, longest_edge / shortest_edge, smallest_angle * degrees);
  if (triangles > 0) {
    text += fmt::format("twice inner over outer radius of the triangles {:.3g} (mean {:.3g}), ", smallest_radius_ratio,
                        mean_radius_ratio);
  }
  text += "valence";
  const char* separator = " ";
  for (const auto& [edges_at_point, count] : valence) {
    text += fmt::format("{}{}: {}", separator, edges_at_point, count);
    separator = ", ";
  }
  return text;
}

std::vector<std::string> MeshReport::remarks() const {
  std::vector<std::string> texts = of_file;
  for (const std::string& repair : repairs(*this)) {
    texts.push_back("repaired: " + repair);
  }
  if (intersections.pairs > 0) {
    texts.push_back(fmt::format("warning: {} pairs of triangles cut through each other", intersections.pairs));
  }
  if (!intersections.all) {
    texts.push_back("warning: too many triangles lie close together to look at all pairs that may cut each other");
  }
  if (slits.near_points > 0) {
    // A little more than the largest gap, in one digit.
    const double digit = std::pow(10, std::floor(std::log10(1.01 * slits.largest_gap)));
    texts.push_back(
        fmt::format("warning: {} points lie as good as on others and are not joined to them, at most {:.2g} m apart: "
                    "mesh.merge_distance {:.2g} merges them",
                    slits.near_points, slits.largest_gap, digit * std::ceil(1.01 * slits.largest_gap / digit)));
  }
  if (!slits.on_sides.empty()) {
    const bool is_one = slits.on_sides.size() == 1;
    texts.push_back(fmt::format(
        "warning: point{} {} {}: slits, where nothing joins the faces", is_one ? "" : "s", first_of(slits.on_sides),
        is_one ? "lies on a side of a face that does not have it" : "lie on sides of faces that do not have them"));
  }
  if (smallest_angle * degrees < 1) {
    texts.push_back(
        fmt::format("warning: an angle of {:.2g} degrees in face {}; faces as thin as this may make solvers fail",
                    smallest_angle * degrees, sharpest_face));
  }
  constexpr double harmless = 1e-9;  // The stiffest of the scenes, disc.yaml, fails from 9e-9 on.
  if (rounding > harmless) {
    texts.push_back(fmt::format(
        "warning: so far from the origin that places are rounded to {:.2g} of a side; mesh.shift moves it", rounding));
  }
  return texts;
}

void require_coordinates(const SurfaceMesh& mesh, const std::string& name) {
  constexpr double largest = 1e60;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (!(mesh.points[i].array().abs() <= largest).all()) {
      std::ostringstream text;
      text << name << ": point " << mesh.id_of_point(static_cast<int>(i)) << " is at (" << mesh.points[i].transpose()
           << "), expected finite coordinates of at most " << largest;
      throw Error(text.str());
    }
  }
}

void measure_rounding(const SurfaceMesh& mesh, MeshReport& report) {
  require_coordinates(mesh, report.name);
  double farthest = 0;
  double sum = 0;
  double sides = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t k = 0; k < mesh.faces[f].size(); ++k) {
      const Eigen::Vector3d& corner = mesh.corner(f, k);
      farthest = std::max(farthest, corner.lpNorm<Eigen::Infinity>());
      sum += (mesh.corner(f, k + 1) - corner).norm();
      ++sides;
    }
  }
  constexpr double largest = 1e-6;
  const double step = std::numeric_limits<double>::epsilon() * farthest;
  const double mean_side = sum / sides;
  refuse_if(
      mean_side > 0 && step > largest * mean_side,
      "{}: {:g} m from the origin, where places are rounded to {:g} m; expected at most {:g} of the mean side, {:g} "
      "m: a mesh nearer to the origin",
      report.name, farthest, step, largest, mean_side);
  report.rounding = step / mean_side;
}

MeshReport check_and_repair(SurfaceMesh& mesh, const std::string& name, std::optional<double> merge_distance) {
  MeshReport report;
  report.name = name;
  measure_rounding(mesh, report);
  report.of_file = mesh.remarks;
  report.merged_points = merge_distance ? weld(mesh, *merge_distance) : 0;
  report.removed_faces = remove_collapsed_faces(mesh) + remove_repeated_faces(mesh);
  report.removed_points = remove_unused_points(mesh);
  if (mesh.faces.empty()) {
    throw Error(
        fmt::format("{}: no face is left after {}, expected a surface mesh", name, fmt::join(repairs(report), "; ")));
  }

  std::vector<std::string> faults;  // that cannot be repaired
  const auto add = [&faults](const char* singular, const char* plural, const auto& found) {
    if (!found.empty()) {
      faults.push_back(fmt::format("{} {} ({})", found.size(), found.size() == 1 ? singular : plural, first_of(found)));
    }
  };
  std::vector<int> degenerate;
  std::vector<int> inverted;
  find_bad_faces(mesh, degenerate, inverted);
  add("degenerate face", "degenerate faces", in_file(degenerate, mesh.face_id));
  add("inverted or folded quad", "inverted or folded quads", in_file(inverted, mesh.face_id));

  const std::vector<Side> sides = sorted_sides(mesh);
  const std::vector<Edge> edges = edges_of(sides);
  std::vector<std::string> overfull;
  std::vector<std::array<int, 2>> boundary;
  for (const Edge& edge : edges) {
    if (edge.faces() == 1) {
      boundary.push_back({edge.begin->low, edge.begin->high});
    } else if (edge.faces() > 2) {
      overfull.push_back(fmt::format("{}-{}", mesh.id_of_point(edge.begin->low), mesh.id_of_point(edge.begin->high)));
    }
  }
  add("non-manifold edge", "non-manifold edges", overfull);
  add("non-manifold vertex", "non-manifold vertices", in_file(find_split_points(mesh, edges), mesh.point_id));
  std::vector<int> twisted;
  report.flipped_faces = orient(mesh, edges, twisted);
  add("one-sided piece that cannot be oriented, at face", "one-sided pieces that cannot be oriented, at faces",
      in_file(twisted, mesh.face_id));

  count_topology(mesh, edges, report);
  measure_quality(mesh, report);
  std::vector<int> crossed;
  const std::vector<std::array<int, 3>> triangles = split_faces(mesh, degenerate, crossed);
  add("polygon that cannot be split into triangles", "polygons that cannot be split into triangles",
      in_file(crossed, mesh.face_id));
  require_few_at_each_point(mesh, triangles, name);
  report.intersections = count_self_intersections(mesh.points, triangles);
  if (!faults.empty()) {
    const std::vector<std::string> repaired = repairs(report);
    throw Error(
        fmt::format("{}: {} (numbers from 0), expected a manifold surface; it has {}{}{}{}", name,
                    fmt::join(faults, "; "), report.size(),
                    report.intersections.pairs > 0
                        ? fmt::format("; {} pairs of triangles cut through each other", report.intersections.pairs)
                        : "",
                    repaired.empty() ? "" : "; repaired: ", fmt::join(repaired, "; ")));
  }
  if (report.boundary_edges == 0) {
    report.volume = enclosed_volume(mesh);
  }
  report.slits = find_slits(mesh, boundary);
  report.slits.on_sides = in_file(report.slits.on_sides, mesh.point_id);
  if (report.components > 1) {
    report.nested = find_nested_pieces(mesh, triangles, boundary);
  }
  for (int& point : report.nested.first) {
    point = mesh.id_of_point(point);
  }
  return report;
}

std::string fault_of_quads(const SurfaceMesh& mesh) {
  const auto is_quad = [](const std::vector<int>& face) { return face.size() == 4; };
  const auto first = std::find_if_not(mesh.faces.begin(), mesh.faces.end(), is_quad);
  if (first == mesh.faces.end()) {
    return "";
  }
  const auto others = mesh.faces.end() - first - std::count_if(first, mesh.faces.end(), is_quad);
  return fmt::format(
      "{} of {} faces are no quads (the first is face {} with {} corners), expected quads only: a burning sheet is "
      "built on quads",
      others, mesh.faces.size(), mesh.id_of_face(static_cast<int>(first - mesh.faces.begin())), first->size());
}

}  // namespace pellicle::meshing
