#include "meshing/mesh_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <sstream>
#include <tuple>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "geometry/pi.h"
#include "meshing/self_intersection.h"
#include "meshing/triangulation.h"
#include "meshing/weld.h"

namespace pellicle {
inline namespace meshing {

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

const Eigen::Vector3d& corner_point(const SurfaceMesh& mesh, std::size_t face, std::size_t corner) {
  const std::vector<int>& points = mesh.faces[face];
  return mesh.points[points[corner % points.size()]];
}

/// Keeps the faces that represent themselves and removes the others, whose groups go to their representatives.
/// @param stands representative of each face; -1: none
void keep_faces(SurfaceMesh& mesh, const std::vector<int>& stands) {
  SurfaceMesh kept;
  std::vector<int> target(mesh.faces.size(), -1);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (stands[f] == static_cast<int>(f)) {
      target[f] = static_cast<int>(kept.faces.size());
      kept.face_id.push_back(mesh.id_of_face(static_cast<int>(f)));
      kept.faces.push_back(std::move(mesh.faces[f]));
      if (!mesh.uv.empty()) {
        kept.uv.push_back(std::move(mesh.uv[f]));
      }
      for (const auto& [field, values] : mesh.face_fields) {
        kept.face_fields[field].push_back(values[f]);
      }
    }
  }
  for (auto& entry : mesh.face_groups) {
    std::vector<int> members;
    for (const int face : entry.second) {
      if (const int standing = stands[face]; standing >= 0) {
        members.push_back(target[standing]);
      }
    }
    std::sort(members.begin(), members.end());
    members.erase(std::unique(members.begin(), members.end()), members.end());
    entry.second = std::move(members);
  }
  mesh.faces = std::move(kept.faces);
  mesh.uv = std::move(kept.uv);
  mesh.face_id = std::move(kept.face_id);
  mesh.face_fields = std::move(kept.face_fields);
}

/// Removes corners that repeat the corner before them, and faces of which fewer than three corners are left. @returns
/// how many faces were removed.
int remove_collapsed_faces(SurfaceMesh& mesh) {
  std::vector<int> stands(mesh.faces.size());
  std::iota(stands.begin(), stands.end(), 0);
  int removed = 0;
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
      ++removed;
    }
  }
  if (removed > 0) {
    keep_faces(mesh, stands);
  }
  return removed;
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
  std::vector<std::size_t> order(forms.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&forms](std::size_t f, std::size_t g) { return std::tie(forms[f], f) < std::tie(forms[g], g); });
  std::vector<int> stands(forms.size());
  std::iota(stands.begin(), stands.end(), 0);
  int removed = 0;
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (forms[order[k]] == forms[order[k - 1]]) {
      stands[order[k]] = stands[order[k - 1]];
      ++removed;
    }
  }
  if (removed > 0) {
    keep_faces(mesh, stands);
  }
  return removed;
}

int remove_unused_points(SurfaceMesh& mesh) {
  std::vector<int> target(mesh.points.size(), -1);
  for (const std::vector<int>& face : mesh.faces) {
    for (const int point : face) {
      target[point] = 0;
    }
  }
  int used = 0;
  for (int& number : target) {
    number = number < 0 ? -1 : used++;
  }
  const int unused = static_cast<int>(target.size()) - used;
  if (unused > 0 && used > 0) {
    renumber_points(mesh, target);
  }
  return unused;
}

/// Six times the sum of the volumes between the first point and the fan of each face of a piece, and its scale, to
/// judge what counts as no volume. Faces for which `reversed` is true count the other way round.
template <class Reversed>
std::array<double, 2> six_volumes(const SurfaceMesh& mesh, const std::vector<int>& piece, const Reversed& reversed) {
  double sum = 0;
  double area = 0;
  const Eigen::Vector3d origin = corner_point(mesh, static_cast<std::size_t>(piece.front()), 0);
  for (const int f : piece) {
    const std::size_t face = f;
    const Eigen::Vector3d first = corner_point(mesh, face, 0) - origin;
    for (std::size_t k = 2; k < mesh.faces[face].size(); ++k) {
      const Eigen::Vector3d second = corner_point(mesh, face, k - 1) - origin;
      const Eigen::Vector3d third = corner_point(mesh, face, k) - origin;
      sum += (reversed(face) ? -1 : 1) * first.dot(second.cross(third));
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
    bool agrees;
  };
  std::vector<std::vector<Neighbour>> neighbours(mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    neighbours[f].reserve(mesh.faces[f].size());
  }
  for (const Edge& edge : edges) {
    if (edge.faces() == 2) {
      const Side& first = edge.begin[0];
      const Side& second = edge.begin[1];
      const bool agrees = first.forward != second.forward;
      neighbours[first.face].push_back({second.face, agrees});
      neighbours[second.face].push_back({first.face, agrees});
    }
  }
  enum class State { unseen, kept, flipped };
  std::vector<State> state(mesh.faces.size(), State::unseen);
  int flipped = 0;
  for (std::size_t seed = 0; seed < mesh.faces.size(); ++seed) {
    if (state[seed] != State::unseen) {
      continue;
    }
    state[seed] = State::kept;
    std::vector<int> piece{static_cast<int>(seed)};
    std::size_t flips = 0;
    bool contradiction = false;
    for (std::size_t next = 0; next < piece.size(); ++next) {
      const State here = state[piece[next]];
      for (const Neighbour& neighbour : neighbours[piece[next]]) {
        const bool flip = (here == State::flipped) == neighbour.agrees;
        State& there = state[neighbour.face];
        if (there == State::unseen) {
          there = flip ? State::flipped : State::kept;
          flips += flip ? 1 : 0;
          piece.push_back(neighbour.face);
        } else if ((there == State::flipped) != flip && !contradiction) {
          contradiction = true;
          twisted.push_back(neighbour.face);
        }
      }
    }
    if (contradiction) {
      continue;
    }
    State wrong = 2 * flips > piece.size() ? State::kept : State::flipped;
    const bool closed =
        std::all_of(piece.begin(), piece.end(), [&](int f) { return neighbours[f].size() == mesh.faces[f].size(); });
    if (closed) {
      constexpr double flat = 1e-9;  // two layers that lie on each other enclose nothing
      const auto [volume, scale] =
          six_volumes(mesh, piece, [&state](std::size_t face) { return state[face] == State::flipped; });
      if (std::abs(volume) > flat * scale) {
        wrong = volume < 0 ? State::kept : State::flipped;
      }
    }
    for (const int f : piece) {
      if (state[f] == wrong) {
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

/// The first few names.
std::string first_of(const std::vector<std::string>& names) {
  constexpr std::size_t shown = 5;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), shown); ++i) {
    text += (i > 0 ? ", " : "") + names[i];
  }
  return text + (names.size() > shown ? ", ..." : "");
}

/// Collects the faults that cannot be repaired, as parts of one line.
class Faults {
 public:
  /// `names` are those of the elements; the first few are listed.
  void add(const std::string& singular, const std::string& plural, const std::vector<std::string>& names) {
    if (names.empty()) {
      return;
    }
    parts_.push_back(std::to_string(names.size()) + " " + (names.size() == 1 ? singular : plural) + " (" +
                     first_of(names) + ")");
  }
  bool none() const { return parts_.empty(); }
  const std::vector<std::string>& parts() const { return parts_; }

 private:
  std::vector<std::string> parts_;
};

std::vector<std::string> face_names(const SurfaceMesh& mesh, const std::vector<int>& faces) {
  std::vector<std::string> names(faces.size());
  std::transform(faces.begin(), faces.end(), names.begin(),
                 [&mesh](int face) { return std::to_string(mesh.id_of_face(face)); });
  return names;
}

std::vector<std::string> point_names(const SurfaceMesh& mesh, const std::vector<int>& points) {
  std::vector<std::string> names(points.size());
  std::transform(points.begin(), points.end(), names.begin(),
                 [&mesh](int point) { return std::to_string(mesh.id_of_point(point)); });
  return names;
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
      const Eigen::Vector3d ahead = corner_point(mesh, f, k + 1) - corner_point(mesh, f, k);
      const Eigen::Vector3d back = corner_point(mesh, f, k + corners - 1) - corner_point(mesh, f, k);
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
    const std::size_t face = side.face;
    const std::size_t begin = static_cast<std::size_t>(side.corner);
    const std::size_t end = (begin + 1) % mesh.faces[face].size();
    return first_corner[face] + (side.forward == low ? begin : end);
  };
  DisjointSets fans(corner_count);
  for (const Edge& edge : edges) {
    for (auto side = edge.begin + 1; side < edge.end; ++side) {
      fans.unite(corner_at(*edge.begin, true), corner_at(*side, true));
      fans.unite(corner_at(*edge.begin, false), corner_at(*side, false));
    }
  }
  constexpr std::size_t none = static_cast<std::size_t>(-1);
  std::vector<std::size_t> fan(mesh.points.size(), none);
  std::vector<bool> split(mesh.points.size(), false);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t k = 0; k < mesh.faces[f].size(); ++k) {
      const std::size_t point = mesh.faces[f][k];
      const std::size_t root = fans.find(first_corner[f] + k);
      split[point] = split[point] || (fan[point] != none && fan[point] != root);
      fan[point] = root;
    }
  }
  std::vector<int> points;
  for (std::size_t i = 0; i < split.size(); ++i) {
    if (split[i]) {
      points.push_back(static_cast<int>(i));
    }
  }
  return points;
}

/// The triangles of all faces that can be split; those that cannot, and are not `degenerate` already, are faults.
std::vector<std::array<int, 3>> split_faces(const SurfaceMesh& mesh, const std::vector<int>& degenerate,
                                            Faults& faults) {
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> crossed;
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
  faults.add("polygon that cannot be split into triangles", "polygons that cannot be split into triangles",
             face_names(mesh, crossed));
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
  if (*largest > most) {
    throw Error(name + ": " + std::to_string(*largest) + " triangles meet at point " +
                std::to_string(mesh.id_of_point(static_cast<int>(largest - count.begin()))) + ", expected at most " +
                std::to_string(most));
  }
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
    const std::size_t low = edge.begin->low;
    const std::size_t high = edge.begin->high;
    ++valence[low];
    ++valence[high];
    for (auto side = edge.begin + 1; side < edge.end; ++side) {
      pieces.unite(static_cast<std::size_t>(edge.begin->face), static_cast<std::size_t>(side->face));
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
  report.shortest_edge = (corner_point(mesh, 0, 1) - corner_point(mesh, 0, 0)).norm();
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const std::size_t corners = mesh.faces[f].size();
    Eigen::Vector3d twice_area = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < corners; ++k) {
      const Eigen::Vector3d ahead = corner_point(mesh, f, k + 1) - corner_point(mesh, f, k);
      const Eigen::Vector3d back = corner_point(mesh, f, k + corners - 1) - corner_point(mesh, f, k);
      const double angle = std::atan2(ahead.cross(back).norm(), ahead.dot(back));
      if (angle < report.smallest_angle) {
        report.smallest_angle = angle;
        report.sharpest_face = mesh.id_of_face(static_cast<int>(f));
      }
      report.shortest_edge = std::min(report.shortest_edge, ahead.norm());
      report.longest_edge = std::max(report.longest_edge, ahead.norm());
      const Eigen::Vector3d& origin = corner_point(mesh, f, 0);
      twice_area += (corner_point(mesh, f, k) - origin).cross(corner_point(mesh, f, k + 1) - origin);
    }
    report.area += 0.5 * twice_area.norm();
    if (corners == 3) {
      const double ratio = radius_ratio(corner_point(mesh, f, 0), corner_point(mesh, f, 1), corner_point(mesh, f, 2));
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
  const auto add = [&texts](int count, const char* singular, const char* plural, const char* what) {
    if (count > 0) {
      texts.push_back(std::to_string(count) + " " + (count == 1 ? singular : plural) + " " + what);
    }
  };
  add(report.merged_points, "duplicate point", "duplicate points", "merged with others at the same place");
  add(report.removed_faces, "face", "faces", "removed that repeated another or had collapsed");
  add(report.removed_points, "point", "points", "removed that no face used");
  add(report.flipped_faces, "face", "faces", "flipped to agree with the neighbours or to face outward");
  return texts;
}

std::string join(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) {
    all += (all.empty() ? "" : "; ") + text;
  }
  return all;
}

}  // namespace

std::string MeshReport::size() const {
  std::ostringstream size;
  size << points << " points, " << faces << " faces (" << quads << " quads, " << triangles << " triangles), "
       << components << (components == 1 ? " piece, " : " pieces, ");
  if (boundary_edges == 0) {
    size << "closed";
    if (volume != 0) {
      size << ", encloses " << volume << " m^3";
    }
  } else {
    size << "open, " << boundary_edges << " boundary edges in " << boundary_loops
         << (boundary_loops == 1 ? " loop" : " loops");
  }
  return size.str();
}

std::string MeshReport::quality() const {
  std::ostringstream quality;
  quality.precision(3);
  quality << "area " << area << " m^2, edges " << shortest_edge << " to " << longest_edge << " m (ratio "
          << longest_edge / shortest_edge << "), smallest angle " << smallest_angle * degrees << " deg, ";
  if (triangles > 0) {
    quality << "twice inner over outer radius of the triangles " << smallest_radius_ratio << " (mean "
            << mean_radius_ratio << "), ";
  }
  quality << "valence";
  const char* separator = " ";
  for (const auto& [edges_at_point, count] : valence) {
    quality << separator << edges_at_point << ": " << count;
    separator = ", ";
  }
  return quality.str();
}

std::vector<std::string> MeshReport::remarks() const {
  std::vector<std::string> texts = of_file;
  for (const std::string& repair : repairs(*this)) {
    texts.push_back("repaired: " + repair);
  }
  if (intersections > 0) {
    texts.push_back("warning: " + std::to_string(intersections) + " pairs of triangles cut through each other");
  }
  if (!all_intersections) {
    texts.push_back("warning: too many triangles lie close together to look at all pairs that may cut each other");
  }
  if (slits.near_points > 0) {
    // A little more than the largest gap, in one digit.
    const double digit = std::pow(10, std::floor(std::log10(1.01 * slits.largest_gap)));
    std::ostringstream text;
    text.precision(2);
    text << "warning: " << slits.near_points << " points lie as good as on others and are not joined to them, at most "
         << slits.largest_gap << " m apart: mesh.merge_distance " << digit * std::ceil(1.01 * slits.largest_gap / digit)
         << " merges them";
    texts.push_back(text.str());
  }
  if (!slits.on_sides.empty()) {
    const bool is_one = slits.on_sides.size() == 1;
    std::vector<std::string> names;
    std::transform(slits.on_sides.begin(), slits.on_sides.end(), std::back_inserter(names),
                   [](int point) { return std::to_string(point); });
    texts.push_back(
        "warning: point" + std::string(is_one ? " " : "s ") + first_of(names) +
        (is_one ? " lies on a side of a face that does not have it" : " lie on sides of faces that do not have them") +
        ": slits, where nothing joins the faces");
  }
  if (smallest_angle * degrees < 1) {
    std::ostringstream angle;
    angle.precision(2);
    angle << "warning: an angle of " << smallest_angle * degrees << " degrees in face " << sharpest_face
          << "; faces as thin as this may make solvers fail";
    texts.push_back(angle.str());
  }
  constexpr double harmless = 1e-9;  // The stiffest of the scenes, disc.yaml, fails from 9e-9 on.
  if (rounding > harmless) {
    std::ostringstream text;
    text.precision(2);
    text << "warning: so far from the origin that places are rounded to " << rounding
         << " of a side; mesh.shift moves it";
    texts.push_back(text.str());
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
  double farthest = 0;
  double sum = 0;
  double sides = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t k = 0; k < mesh.faces[f].size(); ++k) {
      const Eigen::Vector3d& corner = corner_point(mesh, f, k);
      farthest = std::max(farthest, corner.lpNorm<Eigen::Infinity>());
      sum += (corner_point(mesh, f, k + 1) - corner).norm();
      ++sides;
    }
  }
  constexpr double largest = 1e-6;
  const double step = std::numeric_limits<double>::epsilon() * farthest;
  const double mean_side = sum / sides;
  if (mean_side > 0 && step > largest * mean_side) {
    std::ostringstream text;
    text << report.name << ": " << farthest << " m from the origin, where places are rounded to " << step
         << " m; expected at most " << largest << " of the mean side, " << mean_side
         << " m: a mesh nearer to the origin";
    throw Error(text.str());
  }
  report.rounding = step / mean_side;
}

MeshReport check_and_repair(SurfaceMesh& mesh, const std::string& name, std::optional<double> merge_distance) {
  require_coordinates(mesh, name);
  MeshReport report;
  report.name = name;
  measure_rounding(mesh, report);
  report.of_file = mesh.remarks;
  report.merged_points = merge_distance ? weld(mesh, *merge_distance) : 0;
  report.removed_faces = remove_collapsed_faces(mesh) + remove_repeated_faces(mesh);
  report.removed_points = remove_unused_points(mesh);
  if (mesh.faces.empty()) {
    throw Error(name + ": no face is left after " + join(repairs(report)) + ", expected a surface mesh");
  }

  Faults faults;
  std::vector<int> degenerate;
  std::vector<int> inverted;
  find_bad_faces(mesh, degenerate, inverted);
  faults.add("degenerate face", "degenerate faces", face_names(mesh, degenerate));
  faults.add("inverted or folded quad", "inverted or folded quads", face_names(mesh, inverted));

  const std::vector<Side> sides = sorted_sides(mesh);
  const std::vector<Edge> edges = edges_of(sides);
  std::vector<std::string> overfull;
  std::vector<std::array<int, 2>> boundary;
  for (const Edge& edge : edges) {
    if (edge.faces() == 1) {
      boundary.push_back({edge.begin->low, edge.begin->high});
    } else if (edge.faces() > 2) {
      overfull.push_back(std::to_string(mesh.id_of_point(edge.begin->low)) + "-" +
                         std::to_string(mesh.id_of_point(edge.begin->high)));
    }
  }
  faults.add("non-manifold edge", "non-manifold edges", overfull);
  faults.add("non-manifold vertex", "non-manifold vertices", point_names(mesh, find_split_points(mesh, edges)));
  std::vector<int> twisted;
  report.flipped_faces = orient(mesh, edges, twisted);
  faults.add("one-sided piece that cannot be oriented, at face", "one-sided pieces that cannot be oriented, at faces",
             face_names(mesh, twisted));

  count_topology(mesh, edges, report);
  measure_quality(mesh, report);
  const std::vector<std::array<int, 3>> triangles = split_faces(mesh, degenerate, faults);
  require_few_at_each_point(mesh, triangles, name);
  const SelfIntersections intersections = count_self_intersections(mesh.points, triangles);
  report.intersections = intersections.pairs;
  report.all_intersections = intersections.all;
  if (faults.none() && report.boundary_edges == 0) {
    report.volume = enclosed_volume(mesh);
  }
  if (faults.none()) {
    report.slits = find_slits(mesh, boundary);
    if (report.components > 1) {
      report.nested = find_nested_pieces(mesh, triangles, boundary);
    }
    for (int& point : report.slits.on_sides) {
      point = mesh.id_of_point(point);
    }
    for (int& point : report.nested.first) {
      point = mesh.id_of_point(point);
    }
  }
  if (!faults.none()) {
    std::string text =
        name + ": " + join(faults.parts()) + " (numbers from 0), expected a manifold surface; it has " + report.size();
    if (report.intersections > 0) {
      text += "; " + std::to_string(report.intersections) + " pairs of triangles cut through each other";
    }
    const std::string repaired = join(repairs(report));
    throw Error(text + (repaired.empty() ? "" : "; repaired: " + repaired));
  }
  return report;
}

std::string fault_of_quads(const SurfaceMesh& mesh) {
  std::vector<int> others;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (mesh.faces[f].size() != 4) {
      others.push_back(static_cast<int>(f));
    }
  }
  if (others.empty()) {
    return "";
  }
  const std::size_t corners = mesh.faces[others.front()].size();
  return std::to_string(others.size()) + " of " + std::to_string(mesh.faces.size()) +
         " faces are no quads (the first is face " + std::to_string(mesh.id_of_face(others.front())) + " with " +
         std::to_string(corners) + " corners), expected quads only: a burning sheet is built on quads";
}

}  // namespace meshing
}  // namespace pellicle
