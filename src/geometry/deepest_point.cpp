#include "geometry/deepest_point.h"

#include <algorithm>
#include <vector>

#include "geometry/nearest_points.h"

namespace pellicle::geometry {

namespace {

/// A part of the triangle, as weights of its corners.
struct Part {
  Triangle weights;
  double bound = 0;  ///< lower bound of the distance in the part [m]

  bool operator<(const Part& other) const { return bound > other.bound; }  // for a heap with the least bound in front
};

struct Search {
  const Solid& solid;
  const Triangle& corners;
  std::optional<DeepestPoint> best = std::nullopt;

  Eigen::Vector3d at(const Eigen::Vector3d& weights) const {
    return weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2];
  }

  /// Evaluates a point. @returns the distance there
  SignedDistance look(const Eigen::Vector3d& weights) {
    const SignedDistance gap = signed_distance(solid, at(weights));
    if (!best || gap.distance < best->gap.distance) {
      best = DeepestPoint{weights, gap};
    }
    return gap;
  }

  /// Evaluates the middle of a part and sets its bound.
  void look_at(Part& part) {
    const Eigen::Vector3d middle = (part.weights[0] + part.weights[1] + part.weights[2]) / 3;
    const SignedDistance gap = look(middle);
    const Triangle places{at(part.weights[0]), at(part.weights[1]), at(part.weights[2])};
    part.bound = least_distance(solid, places, at(middle), gap);
  }
};

/// Halves the way to every side until the distance no longer falls by more than the tolerance.
void bracket(Search& search, double size, double tolerance) {
  static const std::array<Eigen::Vector3d, 3> directions{Eigen::Vector3d(1, -1, 0), Eigen::Vector3d(0, 1, -1),
                                                         Eigen::Vector3d(-1, 0, 1)};
  constexpr int most = 200;  // evaluations at most, in case of a long valley
  int looks = 0;
  for (double step = 1.0 / 16; step * size > 0.25 * tolerance && looks < most;) {
    const double before = search.best->gap.distance;
    const Eigen::Vector3d centre = search.best->weights;
    for (const Eigen::Vector3d& direction : directions) {
      for (const double sign : {1.0, -1.0}) {
        const Eigen::Vector3d weights = centre + sign * step * direction;
        if (weights.minCoeff() >= 0) {
          search.look(weights);
          ++looks;
        }
      }
    }
    if (!(search.best->gap.distance < before)) {
      step /= 2;
    }
  }
}

}  // namespace

std::array<Triangle, 4> quarters(const Triangle& triangle) {
  const auto& [a, b, c] = triangle;
  const Triangle middle{(a + b) / 2, (b + c) / 2, (c + a) / 2};
  return {Triangle{a, middle[0], middle[2]}, Triangle{middle[0], b, middle[1]}, Triangle{middle[2], middle[1], c},
          middle};
}

double least_distance(const Solid& solid, const Triangle& corners, const Eigen::Vector3d& middle,
                      const SignedDistance& gap) {
  double rise = 0;
  for (const Eigen::Vector3d& corner : corners) {
    const Eigen::Vector3d arm = corner - middle;
    rise = std::min(rise, solid.is_convex() ? gap.normal.dot(arm) : -arm.norm());
  }
  return gap.distance + rise;
}

std::optional<DeepestPoint> deepest_point(const Solid& solid, const Triangle& corners, double reach, double tolerance) {
  Search search{solid, corners};
  Part whole{{Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()}};
  search.look_at(whole);
  if (whole.bound > reach) {
    return std::nullopt;
  }
  for (const Eigen::Vector3d& corner : whole.weights) {
    search.look(corner);
  }
  if (std::holds_alternative<Sphere>(solid.shape)) {
    const NearestPoints nearest = nearest_of_point_and_triangle({solid.pose.place, corners[0], corners[1], corners[2]});
    search.look(-Eigen::Map<const Eigen::Vector3d>(nearest.weights.data() + 1));
  } else if (!std::holds_alternative<HalfSpace>(solid.shape)) {
    const int most = solid.is_convex() ? 400 : 100;  // parts
    std::vector<Part> heap{whole};
    for (int parts = 0; parts < most && !heap.empty() && heap.front().bound < search.best->gap.distance - tolerance;) {
      std::pop_heap(heap.begin(), heap.end());
      const Part part = heap.back();
      heap.pop_back();
      for (const Triangle& weights : quarters(part.weights)) {
        Part quarter{weights};
        search.look_at(quarter);
        quarter.bound = std::max(quarter.bound, part.bound);
        if (quarter.bound < std::min(reach, search.best->gap.distance - tolerance)) {
          heap.push_back(quarter);
          std::push_heap(heap.begin(), heap.end());
        }
        ++parts;
      }
    }
    if (!heap.empty()) {
      bracket(search, longest_side(corners), tolerance);
    }
  }
  return search.best->gap.distance > reach ? std::nullopt : search.best;
}

}  // namespace pellicle::geometry
