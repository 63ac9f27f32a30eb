#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "geometry/pressure_load.h"
#include "meshing/implicit_surface.h"
#include "meshing/surface_mesh.h"

namespace pellicle::meshing {

/// Turns closed triangle meshes on an implicit surface into ones of nearly equilateral triangles: long edges are split,
/// short ones collapsed, edges flipped towards six at each point, points moved along the surface to the middle of their
/// neighbours and back onto it (M. Botsch, L. Kobbelt, "A remeshing approach to multiresolution modeling", 2004).
///
/// Half-edges 3f, 3f + 1, 3f + 2 go round triangle f; each has a twin in the neighbour. All loops go by number, so that
/// the result is deterministic.
class IsotropicRemesher {
 public:
  /// @throws Error in one line, after `key`, if the mesh is not closed or two surfaces meet in a point or edge.
  IsotropicRemesher(const SurfaceMesh& mesh, const ImplicitSurface& surface, const std::string& key);

  /// Splits and collapses edges towards a length [m], flips, and relaxes once.
  void remesh(double edge_length);
  /// Splits the longest and collapses the shortest edges until there are `count` points, or nothing can be collapsed.
  void reach(int count);
  /// Flips and relaxes once; counts stay. Flips make the smallest angles larger.
  void relax();

  /// Puts all points onto the surface, to rounding.
  void project();

  int points() const { return active_points_; }
  /// Whether all points are on the surface, to rounding, and all triangles face outward.
  bool follows_surface() const;
  /// The mesh, without gaps in the numbers.
  SurfaceMesh mesh() const;

 private:
  int to(int h) const { return from_[next(h)]; }
  static int next(int h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static int previous(int h) { return h % 3 == 0 ? h + 2 : h - 1; }
  int half_edges() const { return static_cast<int>(from_.size()); }
  bool alive(int h) const { return from_[h] >= 0; }
  /// The points of the two triangles at the edge of a half-edge: its ends a and b, and c and d at its side and its
  /// twin's.
  std::array<int, 4> corners(int h) const { return {from_[h], to(h), from_[previous(h)], from_[previous(twin_[h])]}; }
  double length(int h) const { return (points_[to(h)] - points_[from_[h]]).norm(); }
  double mean_edge_length() const;
  Eigen::Vector3d area_vector(int a, int b, int c) const {
    return geometry::area_vector(points_[a], points_[b], points_[c]);
  }
  double smallest_angle(int a, int b, int c) const;

  /// Calls visit(h) with one half-edge of every edge, also of those that a visit makes.
  template <class Visit>
  void for_each_edge(const Visit& visit) {
    for (int h = 0; h < half_edges(); ++h) {
      if (alive(h) && h < twin_[h]) {
        visit(h);
      }
    }
  }
  /// Calls visit(h) with every half-edge that leaves the point.
  template <class Visit>
  void for_each_spoke(int point, const Visit& visit) const {
    const int first = out_[point];
    int h = first;
    do {
      visit(h);
      h = twin_[previous(h)];
    } while (h != first);
  }
  bool joined(int a, int b) const {
    bool found = false;
    for_each_spoke(a, [&](int h) { found = found || to(h) == b; });
    return found;
  }

  void pair(int h, int twin) {
    twin_[h] = twin;
    twin_[twin] = h;
  }
  bool is_longest(int h) const;
  void split(int h);
  bool collapse(int h, double longest);
  bool may_flip(int h) const;
  void flip(int h);
  /// Flips the edges (a, b) between the points c and d for which `is_better(a, b, c, d)`.
  template <class IsBetter>
  void flip_where(const IsBetter& is_better) {
    for_each_edge([&](int h) {
      const auto [a, b, c, d] = corners(h);
      if (is_better(a, b, c, d) && may_flip(h)) {
        flip(h);
      }
    });
  }
  void smooth();

  const ImplicitSurface& surface_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<int> out_;      ///< a half-edge that leaves the point, -1: the point is gone
  std::vector<int> valence_;  ///< of each point
  std::vector<int> from_;     ///< point that the half-edge leaves, -1: its triangle is gone
  std::vector<int> twin_;
  int active_points_ = 0;
};

}  // namespace pellicle::meshing
