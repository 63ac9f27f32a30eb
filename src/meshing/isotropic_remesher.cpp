#include "meshing/isotropic_remesher.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "base/error.h"

namespace pellicle::meshing {

namespace {

// Botsch and Kobbelt: a split or collapse beyond these brings the edge nearer to the wanted length.
constexpr double longest_share = 4.0 / 3;
constexpr double shortest_share = 4.0 / 5;
constexpr int regular_valence = 6;

/// Total deviation of four points from valence 6.
int irregularity(int a, int b, int c, int d) {
  const auto square = [](int valence) { return (valence - regular_valence) * (valence - regular_valence); };
  return square(a) + square(b) + square(c) + square(d);
}

}  // namespace

IsotropicRemesher::IsotropicRemesher(const SurfaceMesh& mesh, const ImplicitSurface& surface, const std::string& key)
    : surface_(surface),
      points_(mesh.points),
      out_(mesh.points.size(), -1),
      valence_(mesh.points.size(), 0),
      active_points_(static_cast<int>(mesh.points.size())) {
  std::map<std::pair<int, int>, int> by_ends;
  for (const std::vector<int>& face : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int h = half_edges();
      const bool is_new = by_ends.emplace(std::pair(face[k], face[(k + 1) % 3]), h).second;
      refuse_if(!is_new, "{}: the surface touches itself, expected solids that overlap more, or less", key);
      from_.push_back(face[k]);
      out_[face[k]] = h;
      ++valence_[face[k]];
    }
  }
  twin_.resize(from_.size());
  for (const auto& [ends, h] : by_ends) {
    const auto twin = by_ends.find({ends.second, ends.first});
    refuse_if(twin == by_ends.end(), "{}: the surface is not closed, expected one within its bounds", key);
    twin_[h] = twin->second;
  }
}

double IsotropicRemesher::smallest_angle(int a, int b, int c) const {
  const double double_area = 2 * area_vector(a, b, c).norm();
  const auto product = [&](int at, int one, int other) {
    return (points_[one] - points_[at]).dot(points_[other] - points_[at]);
  };
  return std::atan2(double_area, std::max({product(a, b, c), product(b, c, a), product(c, a, b)}));
}

/// Whether no side of its two triangles is longer.
bool IsotropicRemesher::is_longest(int h) const {
  const int t = twin_[h];
  return length(h) >= std::max({length(next(h)), length(previous(h)), length(next(t)), length(previous(t))});
}

/// Triangles (a, b, c) and (b, a, d) get a new point m in the middle of a b: (a, m, c), (m, b, c), (m, a, d), (b, m,
/// d).
void IsotropicRemesher::split(int h) {
  const int t = twin_[h];
  const int n = next(h);
  const int tp = previous(t);
  const auto [a, b, c, d] = corners(h);
  const int across_bc = twin_[n];
  const int across_db = twin_[tp];
  const int m = static_cast<int>(points_.size());
  const Eigen::Vector3d middle = 0.5 * (points_[a] + points_[b]);
  points_.emplace_back(middle + surface_.step_onto(middle, 0.5 * length(h)));
  const int one = half_edges();  // (m, b, c)
  const int other = one + 3;     // (b, m, d)
  from_.insert(from_.end(), {m, b, c, b, m, d});
  twin_.resize(from_.size());
  from_[n] = m;
  from_[t] = m;
  pair(one, other);
  pair(one + 1, across_bc);
  pair(one + 2, n);
  pair(other + 1, tp);
  pair(other + 2, across_db);
  out_.push_back(one);
  out_[b] = one + 1;
  valence_.push_back(4);
  ++valence_[c];
  ++valence_[d];
  ++active_points_;
}

/// Collapses an edge to its middle. @returns whether that is possible without touching, folding or an edge beyond
/// `longest`.
bool IsotropicRemesher::collapse(int h, double longest) {
  const int t = twin_[h];
  const auto [a, b, c, d] = corners(h);
  if (valence_[c] <= 3 || valence_[d] <= 3 || valence_[a] + valence_[b] < 7) {
    return false;
  }
  const Eigen::Vector3d middle = 0.5 * (points_[a] + points_[b]);
  const Eigen::Vector3d merged = middle + surface_.step_onto(middle, 0.5 * length(h));
  bool possible = true;
  const auto look = [&, c = c, d = d](int point, int end) {
    for_each_spoke(point, [&](int spoke) {
      const int neighbour = to(spoke);
      if (neighbour == end) {
        return;
      }
      // Common neighbours other than c and d would be pinched off.
      possible = possible && (neighbour == c || neighbour == d || !joined(neighbour, end)) &&
                 (points_[neighbour] - merged).norm() < longest;
      const int after = from_[previous(spoke)];
      if (after != end) {
        const Eigen::Vector3d before = (points_[neighbour] - points_[point]).cross(points_[after] - points_[point]);
        const Eigen::Vector3d now = (points_[neighbour] - merged).cross(points_[after] - merged);
        possible = possible && now.dot(before) > 0.5 * now.norm() * before.norm();
      }
    });
  };
  look(a, b);
  look(b, a);
  if (!possible) {
    return false;
  }
  std::vector<int> spokes;
  for_each_spoke(b, [&spokes](int spoke) { spokes.push_back(spoke); });
  for (const int spoke : spokes) {
    from_[spoke] = a;
  }
  const int to_c = twin_[previous(h)];
  const int from_c = twin_[next(h)];
  const int from_d = twin_[next(t)];
  const int to_d = twin_[previous(t)];
  for (const int first : {h - h % 3, t - t % 3}) {
    std::fill_n(from_.begin() + first, 3, -1);
  }
  pair(to_c, from_c);
  pair(to_d, from_d);
  out_[a] = to_c;
  out_[b] = -1;
  out_[c] = from_c;
  out_[d] = from_d;
  valence_[a] += valence_[b] - 4;
  --valence_[c];
  --valence_[d];
  points_[a] = merged;
  --active_points_;
  return true;
}

/// Whether the other diagonal of the two triangles is new and gives two that face the same way.
bool IsotropicRemesher::may_flip(int h) const {
  const auto [a, b, c, d] = corners(h);
  const Eigen::Vector3d both = area_vector(a, b, c) + area_vector(b, a, d);
  const auto faces_well = [&both](const Eigen::Vector3d& area) {
    return area.dot(both) > 0.5 * area.norm() * both.norm();
  };
  return valence_[a] > 3 && valence_[b] > 3 && faces_well(area_vector(a, d, c)) && faces_well(area_vector(b, c, d)) &&
         !joined(c, d);
}

/// Triangles (a, b, c) and (b, a, d) become (d, c, a) and (c, d, b).
void IsotropicRemesher::flip(int h) {
  const int t = twin_[h];
  const auto [a, b, c, d] = corners(h);
  const int across_bc = twin_[next(h)];
  const int across_ca = twin_[previous(h)];
  const int across_ad = twin_[next(t)];
  const int across_db = twin_[previous(t)];
  from_[h] = d;
  from_[next(h)] = c;
  from_[previous(h)] = a;
  from_[t] = c;
  from_[next(t)] = d;
  from_[previous(t)] = b;
  pair(next(h), across_ca);
  pair(previous(h), across_ad);
  pair(next(t), across_db);
  pair(previous(t), across_bc);
  out_[a] = previous(h);
  out_[b] = previous(t);
  out_[c] = next(h);
  out_[d] = next(t);
  --valence_[a];
  --valence_[b];
  ++valence_[c];
  ++valence_[d];
}

/// Moves every point to the middle of its neighbours along the tangent plane, then towards the surface.
void IsotropicRemesher::smooth() {
  std::vector<Eigen::Vector3d> moved = points_;
  for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
    if (out_[i] < 0) {
      continue;
    }
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double reach = 0;
    for_each_spoke(i, [&](int h) {
      const Eigen::Vector3d& neighbour = points_[to(h)];
      middle += neighbour / valence_[i];
      normal += (neighbour - points_[i]).cross(points_[from_[previous(h)]] - points_[i]);
      reach += (neighbour - points_[i]).norm() / valence_[i];
    });
    normal.normalize();
    const Eigen::Vector3d slide = middle - points_[i];
    const Eigen::Vector3d there = points_[i] + slide - normal * normal.dot(slide);
    moved[i] = there + surface_.step_onto(there, 0.5 * reach);
  }
  points_ = std::move(moved);
}

void IsotropicRemesher::remesh(double edge_length) {
  // A side that a split has made is split too, but only if it is the longest of its two triangles: otherwise needles
  // get points without end.
  const int old = half_edges();
  for_each_edge([&](int h) {
    if (length(h) > longest_share * edge_length && (h < old || is_longest(h))) {
      split(h);
    }
  });
  for_each_edge([&](int h) {
    if (length(h) < shortest_share * edge_length) {
      collapse(h, longest_share * edge_length);
    }
  });
  flip_where([this](int a, int b, int c, int d) {
    return irregularity(valence_[a] - 1, valence_[b] - 1, valence_[c] + 1, valence_[d] + 1) <
           irregularity(valence_[a], valence_[b], valence_[c], valence_[d]);
  });
  smooth();
}

void IsotropicRemesher::reach(int count) {
  const bool grow = points() < count;
  std::vector<std::pair<double, int>> edges;
  for_each_edge([&](int h) { edges.emplace_back(grow ? -length(h) : length(h), h); });
  std::sort(edges.begin(), edges.end());
  for (const auto& [key, h] : edges) {
    if (points() == count) {
      break;
    }
    if (grow) {
      split(h);
    } else if (alive(h)) {
      collapse(h, std::numeric_limits<double>::infinity());
    }
  }
}

void IsotropicRemesher::relax() {
  flip_where([this](int a, int b, int c, int d) {
    const double now = std::min(smallest_angle(a, b, c), smallest_angle(b, a, d));
    const double flipped = std::min(smallest_angle(d, c, a), smallest_angle(c, d, b));
    return flipped > now * (1 + 1e-9);
  });
  smooth();
}

void IsotropicRemesher::project() {
  constexpr int steps = 8;
  const double longest = 0.1 * mean_edge_length();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for (int step = 0; step < steps && out_[i] >= 0; ++step) {
      const Eigen::Vector3d move = surface_.step_onto(points_[i], longest);
      points_[i] += move;
      if (move.norm() < 1e-9 * longest) {
        break;
      }
    }
  }
}

double IsotropicRemesher::mean_edge_length() const {
  double sum = 0;
  int count = 0;
  for (int h = 0; h < half_edges(); ++h) {
    if (alive(h)) {
      sum += length(h);
      ++count;
    }
  }
  return sum / count;
}

bool IsotropicRemesher::follows_surface() const {
  const double rounding = 1e-6 * mean_edge_length();
  for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
    if (out_[i] < 0) {
      continue;
    }
    const double distance = surface_.value(points_[i]);
    if (std::abs(distance) > rounding) {
      return false;
    }
    const Eigen::Vector3d normal = surface_.gradient(points_[i], distance);
    bool outward = true;
    for_each_spoke(i, [&](int h) { outward = outward && area_vector(i, to(h), from_[previous(h)]).dot(normal) > 0; });
    if (!outward) {
      return false;
    }
  }
  return true;
}

SurfaceMesh IsotropicRemesher::mesh() const {
  SurfaceMesh mesh;
  std::vector<int> number(points_.size(), -1);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (out_[i] >= 0) {
      number[i] = static_cast<int>(mesh.points.size());
      mesh.points.push_back(points_[i]);
    }
  }
  for (int h = 0; h < half_edges(); h += 3) {
    if (alive(h)) {
      mesh.faces.push_back({number[from_[h]], number[from_[h + 1]], number[from_[h + 2]]});
    }
  }
  return mesh;
}

}  // namespace pellicle::meshing
