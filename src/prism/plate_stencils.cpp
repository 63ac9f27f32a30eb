#include "prism/plate_stencils.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "base/sorting.h"
#include "geometry/principal_axes.h"
#include "geometry/rigid_motion.h"
#include "parallel/collective.h"
#include "parallel/field.h"
#include "parallel/route.h"

namespace pellicle::prism {

namespace {

/// Squared singular values of a fit below this fraction of the largest count as zero: the neighbours do not determine
/// the curvature.
constexpr double negligible = 1e-4;
/// Weight of a point beyond the neighbours, small so that it affects only what the neighbours do not determine. In a
/// net of squares that are cut by both diagonals, moments then balance between the squares' corners and middles.
constexpr double weight_beyond = 0.1;
/// Number of neighbours with which a vertex needs no further points.
constexpr std::size_t enough = 5;
/// Matrices of a fit, with at most five terms: fixed bounds avoid Eigen's blocked products, which take a minute to
/// compile.
using FittedTerms = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Eigen::Dynamic, 5>;
using NormalMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 5, 5>;
/// Cosine up to which a plane counts as perpendicular to the wall.
constexpr double across = 0.1;

/// The rank that owns an item. @param firsts first item of each rank
int owner_of(PetscInt global, const std::vector<PetscInt>& firsts) {
  return static_cast<int>(std::upper_bound(firsts.begin(), firsts.end(), global) - firsts.begin()) - 1;
}

/// A triangle at a vertex: its two other vertices, in the triangle's sense, by global numbers.
struct Wedge {
  PetscInt next;
  PetscInt previous;
  PetscInt element;  ///< local
};

/// The points of a stencil by global numbers.
struct Fan {
  PetscInt centre = 0;
  std::vector<PetscInt> ring;
  std::vector<PetscInt> beyond;
  bool is_closed = true;
};

/// Puts neighbours in order, from an edge of the mesh or from the lowest number, alike on all ranks. Empty if the mesh
/// touches itself at the vertex.
Fan fan_of(std::vector<Wedge> wedges) {
  Fan fan;
  std::sort(wedges.begin(), wedges.end(), [](const Wedge& a, const Wedge& b) { return a.next < b.next; });
  const auto begins = std::find_if(wedges.begin(), wedges.end(), [&](const Wedge& wedge) {
    return std::none_of(wedges.begin(), wedges.end(), [&](const Wedge& other) { return other.previous == wedge.next; });
  });
  fan.is_closed = begins == wedges.end();
  PetscInt last = -1;  // beyond the ring
  for (auto wedge = fan.is_closed ? wedges.begin() : begins;
       wedge != wedges.end() && fan.ring.size() < wedges.size() && (fan.ring.empty() || last != fan.ring.front());
       wedge = std::find_if(wedges.begin(), wedges.end(), [&](const Wedge& other) { return other.next == last; })) {
    fan.ring.push_back(wedge->next);
    last = wedge->previous;
  }
  if (fan.ring.size() < wedges.size() || wedges.empty()) {
    return {};
  }
  if (!fan.is_closed) {
    fan.ring.push_back(last);
  }
  return fan;
}

/// Makes the stencils of a membrane.
class StencilMaker {
 public:
  explicit StencilMaker(const Membrane& membrane) : membrane_(membrane) {}

  /// Collective. See plate_stencils.
  PlateStencils make(const Projectors& projectors, const std::vector<bool>& clamped) {
    std::vector<std::vector<Wedge>> wedges;
    const std::vector<Fan> all = fans(wedges);
    Field rest(made_.reach, 3);
    rest.values().leftCols(membrane_.rest.cols()) = membrane_.rest;
    rest.update_ghosts();
    const Eigen::Matrix3Xd undeformed = rest.values();
    for (std::size_t k = 0; k < all.size(); ++k) {
      const std::size_t vertex = numbers_.find(all[k].centre);
      // A vertex beyond the membrane's matters to this rank inside the wall only.
      const bool is_near = vertex < projectors.size();
      const bool has_one = add(all[k], is_near ? projectors[vertex] : Eigen::Matrix3d::Identity(),
                               is_near && clamped[vertex], undeformed);
      if (has_one && k < wedges.size()) {
        add_corners(made_.stencils.back(), wedges[k], undeformed);
        made_.owned = made_.stencils.size();
      }
    }
    return std::move(made_);
  }

 private:
  /// The points of the stencils of owned vertices, then of stencils of others with an owned vertex. Makes
  /// `made_.reach` and `numbers_`. Collective.
  /// @param wedges set to those of the owned vertices
  std::vector<Fan> fans(std::vector<std::vector<Wedge>>& wedges) {
    const Layout& vertices = membrane_.particles;
    wedges.resize(vertices.owned);
    for (std::size_t e = 0; e < membrane_.triangles.size(); ++e) {
      const auto& triangle = membrane_.triangles[e];
      for (std::size_t k = 0; k < 3; ++k) {
        if (triangle[k] < vertices.owned) {
          wedges[triangle[k]].push_back({vertices.to_global(triangle[(k + 1) % 3]),
                                         vertices.to_global(triangle[(k + 2) % 3]), static_cast<PetscInt>(e)});
        }
      }
    }

    // Owners know all triangles round their vertices; those that have them as ghosts ask.
    const std::vector<PetscInt> firsts = of_all_ranks(vertices.comm, std::vector<PetscInt>{vertices.first});
    std::vector<int> owners;
    for (const PetscInt ghost : vertices.ghost_global) {
      owners.push_back(owner_of(ghost, firsts));
    }
    const Route questions(vertices.comm, owners);
    const std::vector<PetscInt> asked = questions.send(vertices.ghost_global);
    using Triangle = std::array<PetscInt, 3>;
    std::vector<int> askers;
    std::vector<Triangle> triangles;  // by global numbers: the answers, then those known here
    const auto add_triangle = [&](const Triangle& local) {
      triangles.push_back({vertices.to_global(local[0]), vertices.to_global(local[1]), vertices.to_global(local[2])});
    };
    for (std::size_t k = 0; k < asked.size(); ++k) {
      for (const Wedge& wedge : wedges[asked[k] - vertices.first]) {
        add_triangle(membrane_.triangles[wedge.element]);
        askers.push_back(questions.sources()[k]);
      }
    }
    triangles = Route(vertices.comm, askers).send(triangles);
    std::for_each(membrane_.triangles.begin(), membrane_.triangles.end(), add_triangle);
    std::map<std::pair<PetscInt, PetscInt>, PetscInt> opposite;  // of a side, on the left of the way along it
    for (const auto& [a, b, c] : triangles) {
      opposite[{a, b}] = c;
      opposite[{b, c}] = a;
      opposite[{c, a}] = b;
    }

    std::vector<Fan> result;
    for (std::size_t i = 0; i < wedges.size(); ++i) {
      Fan& fan = result.emplace_back(fan_of(wedges[i]));
      fan.centre = vertices.to_global(static_cast<PetscInt>(i));
      for (std::size_t k = 0; fan.is_closed && fan.ring.size() < enough && k < fan.ring.size(); ++k) {
        const auto beyond = opposite.find({fan.ring[(k + 1) % fan.ring.size()], fan.ring[k]});
        if (beyond != opposite.end() && std::find(fan.ring.begin(), fan.ring.end(), beyond->second) == fan.ring.end()) {
          fan.beyond.push_back(beyond->second);
        }
      }
      fan.beyond = without_repeats(std::move(fan.beyond));
    }

    // Stencils go to the ranks that own another of their points.
    struct Point {
      PetscInt centre;
      PetscInt point;
      bool is_beyond;
      bool is_closed;
    };
    std::vector<int> receivers;
    std::vector<Point> sent;
    for (PetscInt i = 0; i < vertices.owned; ++i) {
      const Fan& fan = result[i];
      std::vector<Point> points;
      std::set<int> ranks;
      for (const bool is_beyond : {false, true}) {
        for (const PetscInt point : is_beyond ? fan.beyond : fan.ring) {
          points.push_back({vertices.to_global(i), point, is_beyond, fan.is_closed});
          ranks.insert(owner_of(point, firsts));
        }
      }
      ranks.erase(rank_of(vertices.comm));
      for (const int receiver : ranks) {
        receivers.insert(receivers.end(), points.size(), receiver);
        sent.insert(sent.end(), points.begin(), points.end());
      }
    }
    for (const Point& point : Route(vertices.comm, receivers).send(sent)) {
      if (result.size() == wedges.size() || result.back().centre != point.centre) {
        result.push_back({point.centre, {}, {}, point.is_closed});
      }
      (point.is_beyond ? result.back().beyond : result.back().ring).push_back(point.point);
    }

    std::set<PetscInt> further;
    const LocalNumbers near(vertices);
    const auto reach = [&](PetscInt point) {
      if (near.find(point) < 0) {
        further.insert(point);
      }
    };
    for (const Fan& fan : result) {
      reach(fan.centre);
      std::for_each(fan.ring.begin(), fan.ring.end(), reach);
      std::for_each(fan.beyond.begin(), fan.beyond.end(), reach);
    }
    made_.goes_beyond = on_any_rank(vertices.comm, !further.empty());
    made_.reach = with_ghosts(vertices, {further.begin(), further.end()});
    numbers_ = LocalNumbers(made_.reach);
    return result;
  }

  /// Adds the stencil of a vertex. @returns whether it has one
  bool add(const Fan& fan, const Eigen::Matrix3d& projector, bool is_clamped, const Eigen::Matrix3Xd& rest) {
    if (fan.ring.empty()) {
      return false;
    }
    PlateStencil stencil;
    stencil.centre = numbers_.find(fan.centre);
    stencil.is_closed = fan.is_closed;
    if (!stencil.is_closed) {
      const auto free_directions = std::lround(projector.trace());
      stencil.has_fixed_normal = is_clamped || free_directions == 1;
      if (!stencil.has_fixed_normal) {
        if (free_directions != 2) {
          return false;
        }
        Eigen::Index column = 0;
        const Eigen::Matrix3d constrained = Eigen::Matrix3d::Identity() - projector;
        constrained.diagonal().maxCoeff(&column);
        stencil.mirror = constrained.col(column).normalized();
      }
    }
    stencil.first = made_.points.size();
    made_.points.push_back(stencil.centre);
    for (const PetscInt point : fan.ring) {
      made_.points.push_back(numbers_.find(point));
    }
    stencil.ring_end = made_.points.size();
    for (const PetscInt point : fan.beyond) {
      made_.points.push_back(numbers_.find(point));
    }
    stencil.last = made_.points.size();
    const auto drop = [&] {
      made_.points.resize(stencil.first);
      return false;
    };

    const Eigen::Vector3d here = rest.col(stencil.centre);
    const auto arm = [&](Eigen::Index p) { return Eigen::Vector3d(rest.col(made_.points[p]) - here); };
    Eigen::Vector3d area = Eigen::Vector3d::Zero();
    double flat = 0;
    for (Eigen::Index p = stencil.first + 1; p < stencil.ring_end; ++p) {
      if (stencil.is_closed || p + 1 < stencil.ring_end) {
        const Eigen::Vector3d triangle = arm(p).cross(arm(p + 1 < stencil.ring_end ? p + 1 : stencil.first + 1));
        area += triangle;
        flat += triangle.norm();
      }
    }
    if (!stencil.mirror.isZero(0)) {
      // The wall goes on as its mirror image if both its edges here are in the plane and the wall stands across it.
      const auto lies_in_plane = [&](Eigen::Index p) {
        return std::abs(arm(p).dot(stencil.mirror)) <= 1e-6 * arm(p).norm();
      };
      if (!lies_in_plane(stencil.first + 1) || !lies_in_plane(stencil.ring_end - 1) ||
          std::abs(area.dot(stencil.mirror)) > across * flat) {
        return drop();
      }
      area -= stencil.mirror.dot(area) * stencil.mirror;
    }
    stencil.flatness = area.norm() / flat;
    stencil.normal = area.normalized();
    if (!(stencil.flatness > 0) || !fit(stencil, rest)) {
      return drop();
    }
    made_.stencils.push_back(stencil);
    return true;
  }

  void add_corners(const PlateStencil& stencil, const std::vector<Wedge>& wedges, const Eigen::Matrix3Xd& rest) {
    const Eigen::Vector3d here = rest.col(stencil.centre);
    std::vector<PlateCorner>& corners = made_.corners.emplace_back();
    for (const Wedge& wedge : wedges) {
      const Eigen::Vector3d to_next = rest.col(numbers_.find(wedge.next)) - here;
      const Eigen::Vector3d to_previous = rest.col(numbers_.find(wedge.previous)) - here;
      // The triangle's plane is turned into the tangent plane by the smallest rotation.
      const Eigen::Matrix3d turn = rotation_between(to_next.cross(to_previous), stencil.normal);
      Eigen::Matrix2d edges;
      edges << axes_.transpose() * (turn * to_next), axes_.transpose() * (turn * to_previous);
      corners.push_back({wedge.element, edges.inverse()});
    }
  }

  /// Finds weights and undeformed curvature. @returns whether the neighbours determine it
  bool fit(PlateStencil& stencil, const Eigen::Matrix3Xd& rest) {
    const bool is_mirrored = !stencil.mirror.isZero(0);
    const Eigen::Vector3d along = is_mirrored ? stencil.mirror : stencil.normal.unitOrthogonal();
    axes_ << along, stencil.normal.cross(along);
    const Eigen::Index count = stencil.last - stencil.first - 1;
    Eigen::Matrix3Xd arms(3, count);
    for (Eigen::Index p = 0; p < count; ++p) {
      arms.col(p) = rest.col(made_.points[stencil.first + 1 + p]) - rest.col(stencil.centre);
    }
    // Coordinates in which the neighbours are equally far all round, so that the fit does not depend on how long the
    // triangles are.
    Eigen::Matrix2Xd r = axes_.transpose() * arms;
    Eigen::Matrix2d moments = r.lazyProduct(r.transpose()) / static_cast<double>(count);
    if (is_mirrored) {
      moments(0, 1) = moments(1, 0) = 0;
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> extents;
    extents.computeDirect(moments);
    if (!(extents.eigenvalues()[0] > 1e-6 * extents.eigenvalues()[1])) {
      return false;
    }
    const Eigen::Matrix2d to_even = extents.operatorInverseSqrt();
    r = to_even.lazyProduct(r).eval();

    const int tilts = stencil.has_fixed_normal ? 0 : is_mirrored ? 1 : 2;
    const int bends = is_mirrored && !stencil.has_fixed_normal ? 2 : 3;
    FittedTerms terms(count, tilts + bends);
    Eigen::VectorXd row_weight(count);
    for (Eigen::Index p = 0; p < count; ++p) {
      const double x = r(0, p), y = r(1, p);
      const bool is_own_image = is_mirrored && std::abs(x) < 1e-6;
      const bool is_beyond = stencil.first + 1 + p >= stencil.ring_end;
      row_weight[p] = (is_own_image ? std::sqrt(0.5) : is_beyond ? weight_beyond : 1.0) / (x * x + y * y);
      if (tilts == 2) {
        terms.row(p) << x, y, x * x / 2, x * y, y * y / 2;
      } else if (tilts == 1) {
        terms.row(p) << y, x * x / 2, y * y / 2;
      } else {
        terms.row(p) << x * x / 2, x * y, y * y / 2;
      }
    }
    terms = (row_weight.asDiagonal() * terms).eval();
    const PrincipalAxes normal_matrix = principal_axes(terms.transpose().lazyProduct(terms));
    const Eigen::VectorXd& values = normal_matrix.values;
    const double least = negligible * values.maxCoeff();
    if (!stencil.has_fixed_normal && !(values.minCoeff() > least)) {
      return false;
    }
    const Eigen::VectorXd inverse = (values.array() > least).select(values.cwiseInverse(), 0.0);
    const NormalMatrix pseudo_inverse =
        (normal_matrix.axes * inverse.asDiagonal()).lazyProduct(normal_matrix.axes.transpose());
    const Eigen::MatrixXd coefficients = pseudo_inverse.lazyProduct(terms.transpose()) * row_weight.asDiagonal();
    made_.weights.resize(stencil.last);
    made_.weights[stencil.first].setZero();
    stencil.rest.setZero();
    for (Eigen::Index p = 0; p < count; ++p) {
      const auto b = coefficients.col(p).tail(bends);
      Eigen::Matrix2d even;
      even << b[0], bends == 3 ? b[1] : 0, bends == 3 ? b[1] : 0, b[bends - 1];
      const Eigen::Matrix2d bent = to_even * even * to_even;
      const PlateCurvature weight(bent(0, 0), bent(0, 1), bent(1, 1));
      made_.weights[stencil.first + 1 + p] = weight;
      made_.weights[stencil.first] -= weight;
      stencil.rest += weight * stencil.normal.dot(arms.col(p));
    }
    return true;
  }

  const Membrane& membrane_;
  PlateStencils made_;
  LocalNumbers numbers_;              ///< of the vertices in the reach
  Eigen::Matrix<double, 3, 2> axes_;  ///< of the stencil that was fitted last
};

}  // namespace

PlateStencils plate_stencils(const Membrane& membrane, const Projectors& projectors, const std::vector<bool>& clamped) {
  return StencilMaker(membrane).make(projectors, clamped);
}

}  // namespace pellicle::prism
