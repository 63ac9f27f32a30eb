#include "contact/untangle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "base/disjoint_sets.h"
#include "base/sorting.h"
#include "contact/crossings.h"
#include "geometry/triangle_intersection.h"

namespace pellicle::contact {

namespace {

constexpr int most_sweeps = 1000;
constexpr int most_sweeps_apart = 10;
/// Displacement in a sweep of the points of triangles that touch, as a fraction of the mean side.
constexpr double apart_of_side = 0.01;
/// Largest displacement of a point in a sweep, as a fraction of the mean side.
constexpr double most_of_side = 0.1;
/// Cosine of the angle between an edge and a triangle's normal: below it an edge lies along the triangle.
constexpr double least_cosine = 0.1;

/// An edge, and the third points of its triangles, of which there are two at most.
struct Edge {
  std::array<int, 2> ends;
  std::array<int, 2> thirds;  ///< -1: it has one triangle
};

/// Moves of the particles: their sums, and how many.
using Moves = std::vector<Eigen::Vector4d>;

/// Adds the move of a point to those of its particles.
void add_move(const TangledMesh& mesh, int point, const Eigen::Vector3d& move, Moves& moves) {
  for (const int particle : mesh.particles_of(point)) {
    moves[particle].head<3>() += move;
    moves[particle][3] += 1;
  }
}

/// Direction in which an edge leaves a triangle with the normal N that it cuts through: sum of R - 2 (E.R)/(E.N) N over
/// the triangles A at the edge, with the direction E of the edge and the direction R of the cut into A.
Eigen::Vector3d way_out(const Edge& edge, const std::array<int, 3>& triangle,
                        const std::vector<Eigen::Vector3d>& places) {
  const auto at = [&places](int point) { return places[point]; };
  const Eigen::Vector3d along = (at(edge.ends[1]) - at(edge.ends[0])).normalized();
  const Eigen::Vector3d normal =
      (at(triangle[1]) - at(triangle[0])).cross(at(triangle[2]) - at(triangle[0])).normalized();
  const double cosine = along.dot(normal);
  const double bounded = std::copysign(std::max(std::abs(cosine), least_cosine), cosine);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const int third : edge.thirds) {
    if (third < 0) {
      continue;
    }
    const Eigen::Vector3d into = at(third) - at(edge.ends[0]);
    Eigen::Vector3d cut = normal.cross(along.cross(into)).normalized();
    if (cut.dot(into - along * along.dot(into)) < 0) {
      cut = -cut;
    }
    sum += cut - 2 * along.dot(cut) / bounded * normal;
  }
  return sum;
}

/// The edges of a mesh, and the sweeps that move them out of triangles.
class Edges {
 public:
  explicit Edges(const TangledMesh& mesh)
      : of_triangles_(mesh.triangles.size(), {-1, -1, -1}), neighbours_(mesh.particles.size()) {
    std::map<std::array<int, 2>, int> numbers;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const std::array<int, 3>& triangle = mesh.triangles[t];
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [least, largest] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
        const auto [found, is_new] = numbers.try_emplace({least, largest}, static_cast<int>(edges_.size()));
        if (is_new) {
          edges_.push_back({{least, largest}, {triangle[(k + 2) % 3], -1}});
          of_triangles_[t][k] = found->second;
        } else {
          edges_[found->second].thirds[1] = triangle[(k + 2) % 3];
        }
      }
    }
    const std::vector<Eigen::Vector3d> places = mesh.points();
    for (const Edge& edge : edges_) {
      side_ += (places[edge.ends[1]] - places[edge.ends[0]]).norm() / static_cast<double>(edges_.size());
      for (const int a : mesh.particles_of(edge.ends[0])) {
        for (const int b : mesh.particles_of(edge.ends[1])) {
          if (a != b) {
            neighbours_[a].push_back(b);
            neighbours_[b].push_back(a);
          }
        }
      }
    }
    for (std::vector<int>& list : neighbours_) {
      list = without_repeats(std::move(list));
    }
  }

  const Edge& edge(int number) const { return edges_[number]; }
  double mean_side() const { return side_; }

  /// Moves the particles until no edge cuts through a triangle. @returns the pairs that still do after all sweeps
  std::vector<std::pair<int, int>> shorten_cuts(TangledMesh& mesh) const {
    for (int sweep = 0;; ++sweep) {
      const std::vector<Eigen::Vector3d> places = mesh.points();
      const std::vector<std::pair<int, int>> cuts = find_cuts(mesh.triangles, places);
      if (cuts.empty() || sweep == most_sweeps) {
        return cuts;
      }
      Moves moves(mesh.particles.size(), Eigen::Vector4d::Zero());
      for (const auto& [e, t] : cuts) {
        const Eigen::Vector3d out = way_out(edge(e), mesh.triangles[t], places);
        const Eigen::Vector3d move = most_of_side * side_ / std::sqrt(out.squaredNorm() + 1) * out;
        for (const int point : edge(e).ends) {
          add_move(mesh, point, move, moves);
        }
        for (const int point : mesh.triangles[t]) {
          add_move(mesh, point, -move, moves);
        }
      }
      for (std::size_t i = 0; i < moves.size(); ++i) {
        Eigen::Vector3d move = Eigen::Vector3d::Zero();
        if (moves[i][3] > 0) {
          move = moves[i].head<3>() / moves[i][3];
        } else {
          for (const int j : neighbours_[i]) {
            const Eigen::Vector4d& of_neighbour = moves[j];
            move += 0.5 * of_neighbour.head<3>() /
                    (std::max(of_neighbour[3], 1.0) * static_cast<double>(neighbours_[i].size()));
          }
        }
        if (!mesh.constrained[i]) {
          mesh.particles[i] += move;
        }
      }
    }
  }

 private:
  /// Edges and the triangles that they cut through.
  std::vector<std::pair<int, int>> find_cuts(const std::vector<std::array<int, 3>>& triangles,
                                             const std::vector<Eigen::Vector3d>& places) const {
    std::vector<std::pair<int, int>> found;
    const auto add = [&](int one, int other) {
      const std::array<int, 3>& t = triangles[other];
      for (const int e : of_triangles_[one]) {
        if (e < 0) {
          continue;
        }
        const std::array<int, 2>& ends = edge(e).ends;
        if (std::find_first_of(t.begin(), t.end(), ends.begin(), ends.end()) == t.end() &&
            segment_cuts_triangle(places[ends[0]], places[ends[1]], corners_of(places, t))) {
          found.emplace_back(e, other);
        }
      }
    };
    visit_near_pairs(places, triangles, 0, [&add](int a, int b) {
      add(a, b);
      add(b, a);
    });
    return found;
  }

  std::vector<Edge> edges_;
  /// The edges that each triangle represents, so that each edge comes once; -1: none.
  std::vector<std::array<int, 3>> of_triangles_;
  std::vector<std::vector<int>> neighbours_;  ///< of each particle
  double side_ = 0;                           ///< mean length of the edges [m]
};

/// Moves triangles that touch apart. @param distance by which each of them moves [m] @returns whether there are any
bool part_touching(TangledMesh& mesh, double distance) {
  const std::vector<Eigen::Vector3d> places = mesh.points();
  Moves moves(mesh.particles.size(), Eigen::Vector4d::Zero());
  bool any = false;
  visit_near_pairs(places, mesh.triangles, mesh.touch, [&](int one, int other) {
    const auto [a, b] = std::minmax({one, other});  // by value
    const Triangle corners = corners_of(places, mesh.triangles[a]);
    if (!triangles_touch(corners, corners_of(places, mesh.triangles[b]), mesh.touch)) {
      return;
    }
    any = true;
    const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    for (const auto& [triangle, sign] : {std::pair(a, -1.0), std::pair(b, 1.0)}) {
      for (const int point : mesh.triangles[triangle]) {
        add_move(mesh, point, sign * normal, moves);
      }
    }
  });
  for (std::size_t i = 0; i < moves.size(); ++i) {
    if (moves[i][3] > 0 && !mesh.constrained[i]) {
      mesh.particles[i] += distance / moves[i][3] * moves[i].head<3>();
    }
  }
  return any;
}

/// The connected piece of each particle, by the number of one of its particles.
std::vector<std::size_t> pieces_of(const TangledMesh& mesh) {
  DisjointSets sets(mesh.particles.size());
  for (const std::array<int, 3>& triangle : mesh.triangles) {
    const std::size_t first = mesh.particles_of(triangle[0])[0];
    for (const int point : triangle) {
      for (const int i : mesh.particles_of(point)) {
        sets.unite(first, static_cast<std::size_t>(i));
      }
    }
  }
  std::vector<std::size_t> piece;
  for (std::size_t i = 0; i < mesh.particles.size(); ++i) {
    piece.push_back(sets.find(i));
  }
  return piece;
}

/// The shortest way along an axis after which a piece's box meets that of no other piece.
/// @param gap by which they are apart then [m]
Eigen::Vector3d way_free(const std::vector<Eigen::Vector3d>& particles, const std::vector<std::size_t>& pieces,
                         std::size_t piece, double gap) {
  std::map<std::size_t, Eigen::AlignedBox3d> boxes;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    boxes[pieces[i]].extend(particles[i]);
  }
  const Eigen::AlignedBox3d start = boxes.at(piece);
  boxes.erase(piece);
  Eigen::Vector3d shortest = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
      const auto met = [&] {
        const Eigen::AlignedBox3d there = start.translated(displacement);
        return std::find_if(boxes.begin(), boxes.end(),
                            [&there](const auto& other) { return there.intersects(other.second); });
      };
      for (auto other = met(); other != boxes.end(); other = met()) {
        displacement[axis] = sign > 0 ? other->second.max()[axis] + gap - start.min()[axis]
                                      : other->second.min()[axis] - gap - start.max()[axis];
      }
      if (displacement.norm() < shortest.norm()) {
        shortest = displacement;
      }
    }
  }
  return shortest;
}

}  // namespace

std::vector<Eigen::Vector3d> TangledMesh::points() const {
  std::vector<Eigen::Vector3d> places = particles;
  for (const std::array<int, 4>& corners : centres) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int corner : corners) {
      sum += particles[corner];
    }
    places.push_back(0.25 * sum);
  }
  return places;
}

std::array<int, 4> TangledMesh::particles_of(int point) const {
  const auto first = static_cast<int>(particles.size());
  return point < first ? std::array{point, point, point, point} : centres[point - first];
}

int untangle(TangledMesh& mesh) {
  const Edges edges(mesh);
  for (int sweep = 0; sweep < most_sweeps_apart && part_touching(mesh, apart_of_side * edges.mean_side()); ++sweep) {
  }
  const std::vector<std::size_t> pieces = pieces_of(mesh);
  std::vector<bool> stays(pieces.size(), false);  // of the pieces, by their numbers
  std::vector<int> size(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    stays[pieces[i]] = stays[pieces[i]] || mesh.constrained[i];
    ++size[pieces[i]];
  }
  std::vector<Eigen::Vector3d> start = mesh.particles;
  for (;;) {
    const std::vector<std::pair<int, int>> cuts = edges.shorten_cuts(mesh);
    std::optional<std::size_t> smallest;
    for (const auto& [e, t] : cuts) {
      const auto piece_at = [&](int point) { return pieces[mesh.particles_of(point)[0]]; };
      const std::size_t one = piece_at(edges.edge(e).ends[0]);
      const std::size_t other = piece_at(mesh.triangles[t][0]);
      for (const std::size_t piece : {one, other}) {
        if (one != other && !stays[piece] && (!smallest || size[piece] < size[*smallest])) {
          smallest = piece;
        }
      }
    }
    if (!smallest) {
      return static_cast<int>(cuts.size());
    }
    stays[*smallest] = true;
    const Eigen::Vector3d displacement = way_free(start, pieces, *smallest, edges.mean_side());
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (pieces[i] == *smallest) {
        start[i] += displacement;
      }
    }
    mesh.particles = start;
  }
}

}  // namespace pellicle::contact
