#include "contact/contact_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unsupported/Eigen/BVH>

namespace pellicle {
inline namespace contact {

namespace {

using Box = Eigen::AlignedBox3d;

/// Undeformed distances below this share of the thickness are none: such features are one and the same.
constexpr double least_share = 1e-3;
/// Square of the sine of the angle between edges up to which they are nearly parallel.
constexpr double nearly_parallel = 0.01;

/// What Eigen's traversal of two box trees asks, by its names.
class Search {
 public:
  Search(const ContactMesh& mesh, const Eigen::Matrix3Xd& places, double stiffness)
      : mesh_(mesh),
        places_(places),
        stiffness_(stiffness),
        leader_(static_cast<std::size_t>(mesh.points()), -1),
        margin_(leader_.size()),
        is_own_(leader_.size()),
        leads_side_(mesh.triangles().size()) {
    result_.nearest.assign(leader_.size(), std::numeric_limits<double>::infinity());
    for (PetscInt point = 0; point < mesh.points(); ++point) {
      margin_[static_cast<std::size_t>(point)] = mesh.margin(point);
      is_own_[static_cast<std::size_t>(point)] = mesh.is_own(point);
    }
    struct Side {
      std::array<PetscInt, 2> ends;
      int triangle;
      int number;
    };
    std::vector<Side> sides;
    for (std::size_t t = 0; t < leads_side_.size(); ++t) {
      const std::array<PetscInt, 3>& triangle = mesh.triangles()[t];
      bool touches_own = false;
      for (int k = 0; k < 3; ++k) {
        const PetscInt a = triangle[static_cast<std::size_t>(k)];
        const PetscInt b = triangle[static_cast<std::size_t>((k + 1) % 3)];
        sides.push_back({{std::min(a, b), std::max(a, b)}, static_cast<int>(t), k});
        int& leader = leader_[static_cast<std::size_t>(a)];
        leader = leader < 0 ? static_cast<int>(t) : leader;
        touches_own = touches_own || is_own_[static_cast<std::size_t>(a)];
      }
      touches_own_.push_back(touches_own);
    }
    std::sort(sides.begin(), sides.end(),
              [](const Side& a, const Side& b) { return std::tie(a.ends, a.triangle) < std::tie(b.ends, b.triangle); });
    for (std::size_t s = 0; s < sides.size(); ++s) {
      if (s == 0 || sides[s].ends != sides[s - 1].ends) {
        leads_side_[static_cast<std::size_t>(sides[s].triangle)][static_cast<std::size_t>(sides[s].number)] = true;
      }
    }
  }

  ContactPairs run() {
    std::vector<int> numbers(leads_side_.size());
    std::iota(numbers.begin(), numbers.end(), 0);
    if (!numbers.empty()) {
      const Eigen::KdBVH<double, 3, int> tree(numbers.begin(), numbers.end(), mesh_.boxes().begin(),
                                              mesh_.boxes().end());
      Eigen::BVIntersect(tree, tree, *this);
    }
    return std::move(result_);
  }

  // NOLINTBEGIN(readability-identifier-naming)
  bool intersectVolumeVolume(const Box& a, const Box& b) const { return a.intersects(b); }
  bool intersectVolumeObject(const Box& a, int b) const { return a.intersects(box(b)); }
  bool intersectObjectVolume(int a, const Box& b) const { return b.intersects(box(a)); }
  bool intersectObjectObject(int a, int b) {
    if (a < b && (touches_own_[static_cast<std::size_t>(a)] || touches_own_[static_cast<std::size_t>(b)]) &&
        box(a).intersects(box(b))) {
      add_triangles(a, b);
    }
    return false;
  }
  // NOLINTEND(readability-identifier-naming)

 private:
  const Box& box(int triangle) const { return mesh_.boxes()[static_cast<std::size_t>(triangle)]; }

  /// Points and sides have one triangle that stands for them, so that each pair of features comes once.
  void add_triangles(int a, int b) {
    const std::array<PetscInt, 3>& first = mesh_.triangles()[static_cast<std::size_t>(a)];
    const std::array<PetscInt, 3>& second = mesh_.triangles()[static_cast<std::size_t>(b)];
    for (std::size_t k = 0; k < 3; ++k) {
      if (leader_[static_cast<std::size_t>(first[k])] == a) {
        add({first[k], second[0], second[1], second[2]}, false);
      }
      if (leader_[static_cast<std::size_t>(second[k])] == b) {
        add({second[k], first[0], first[1], first[2]}, false);
      }
      for (std::size_t l = 0; l < 3 && leads_side_[static_cast<std::size_t>(a)][k]; ++l) {
        if (leads_side_[static_cast<std::size_t>(b)][l]) {
          add({first[k], first[(k + 1) % 3], second[l], second[(l + 1) % 3]}, true);
        }
      }
    }
  }

  /// A ball round a feature, and the largest margin of its ends.
  struct Ball {
    Eigen::Vector3d centre;
    double radius = 0;
    double margin = 0;
  };
  template <std::size_t count>
  Ball ball(const PetscInt* points) const {
    Ball ball{Eigen::Vector3d::Zero(), 0, 0};
    for (std::size_t k = 0; k < count; ++k) {
      ball.centre += places_.col(points[k]);
      ball.margin = std::max(ball.margin, margin_[static_cast<std::size_t>(points[k])]);
    }
    ball.centre /= count;
    for (std::size_t k = 0; k < count && count > 1; ++k) {
      ball.radius = std::max(ball.radius, (places_.col(points[k]) - ball.centre).squaredNorm());
    }
    ball.radius = std::sqrt(ball.radius);
    return ball;
  }

  void add(const std::array<PetscInt, 4>& points, bool are_edges) {
    const auto second_feature = points.begin() + (are_edges ? 2 : 1);
    if (std::find_first_of(second_feature, points.end(), points.begin(), second_feature) != points.end()) {
      return;
    }
    const Ball first = are_edges ? ball<2>(points.data()) : ball<1>(points.data());
    const Ball second = are_edges ? ball<2>(points.data() + 2) : ball<3>(points.data() + 1);
    const double reach = first.margin + second.margin;
    const double apart = first.radius + second.radius + reach;
    if ((first.centre - second.centre).squaredNorm() >= apart * apart ||
        std::none_of(points.begin(), points.end(),
                     [this](PetscInt point) { return is_own_[static_cast<std::size_t>(point)]; })) {
      return;
    }
    ContactPair pair{points, are_edges, {}, 0};
    pair.distance = pair.nearest(places_).apart.norm();
    if (pair.distance >= reach) {
      return;
    }
    const double thickness = (mesh_.thickness(points[0]) + mesh_.thickness(points[2])) / 2;
    pair.barrier.thickness = std::min(thickness, rest_distance(pair) / 2);
    if (pair.barrier.thickness < least_share * thickness) {
      return;
    }
    const double share = are_edges ? share_of_edges(points) : 1;
    const auto area = [&](std::size_t k) { return mesh_.area(points[k]); };
    pair.barrier.stiffness =
        share * stiffness_ * (are_edges ? (area(0) + area(1) + area(2) + area(3)) / 16 : area(0) / 2);
    result_.pairs.push_back(pair);
    for (std::size_t k = 0; k < 4; ++k) {
      double& nearest = result_.nearest[static_cast<std::size_t>(points[k])];
      nearest = std::min(nearest, pair.distance);
    }
  }

  /// Where edges are parallel the nearest points are many, and which of them would be found is chance: they press the
  /// less the nearer they are to that when the step starts (points and triangles press there instead).
  double share_of_edges(const std::array<PetscInt, 4>& points) const {
    const Eigen::Vector3d first = mesh_.start(points[1]) - mesh_.start(points[0]);
    const Eigen::Vector3d second = mesh_.start(points[3]) - mesh_.start(points[2]);
    const double lengths = first.squaredNorm() * second.squaredNorm();
    if (lengths == 0) {
      return 0;
    }
    const double c = first.cross(second).squaredNorm() / (nearly_parallel * lengths);
    return c < 1 ? c * (2 - c) : 1;
  }

  double rest_distance(const ContactPair& pair) const {
    std::array<Eigen::Vector3d, 4> corners;
    std::transform(pair.points.begin(), pair.points.end(), corners.begin(),
                   [this](PetscInt point) { return mesh_.rest(point); });
    const NearestPoints nearest = pair.are_edges ? nearest_of_edges(corners) : nearest_of_point_and_triangle(corners);
    return nearest.apart.norm();
  }

  const ContactMesh& mesh_;
  const Eigen::Matrix3Xd& places_;
  double stiffness_;
  std::vector<int> leader_;                      ///< of the points: the triangle that stands for each
  std::vector<double> margin_;                   ///< of the points
  std::vector<bool> is_own_;                     ///< of the points
  std::vector<std::array<bool, 3>> leads_side_;  ///< of the triangles: whether each stands for its sides
  std::vector<bool> touches_own_;                ///< of the triangles
  ContactPairs result_;
};

}  // namespace

// Half of the squared gap is the least of f = |r|^2 / 2, r = sum_k s_k x_k, by what the weights s may become: those
// that are not 0, of each feature with a constant sum. With the free changes a of the weights its second derivative is
// f_xx - f_xa f_aa^-1 f_ax.
Eigen::Matrix<double, 12, 12> ContactPair::gap_curvature(const Eigen::Matrix3Xd& places) const {
  const NearestPoints where = nearest(places);
  const double gap = where.apart.norm();
  Eigen::Matrix<double, 12, 2> mixed = Eigen::Matrix<double, 12, 2>::Zero();  // f_xa
  Eigen::Matrix<double, 3, 2> along = Eigen::Matrix<double, 3, 2>::Zero();    // r_a
  Eigen::Matrix<double, 4, 2> changes = Eigen::Matrix<double, 4, 2>::Zero();  // s_a
  int free = 0;
  for (const auto& [first, last] : {std::pair(0, first_feature()), std::pair(first_feature(), 4)}) {
    int base = -1;
    for (int k = first; k < last; ++k) {
      if (where.weights[static_cast<std::size_t>(k)] == 0) {
        continue;
      }
      if (base < 0) {
        base = k;
        continue;
      }
      changes(k, free) = 1;
      changes(base, free) = -1;
      along.col(free) =
          places.col(points[static_cast<std::size_t>(k)]) - places.col(points[static_cast<std::size_t>(base)]);
      ++free;
    }
  }
  Eigen::Matrix<double, 12, 1> slope;  // f_x
  for (int k = 0; k < 4; ++k) {
    const double weight = where.weights[static_cast<std::size_t>(k)];
    slope.segment<3>(3 * k) = weight * where.apart;
    for (int a = 0; a < free; ++a) {
      mixed.block<3, 1>(3 * k, a) = changes(k, a) * where.apart + weight * along.col(a);
    }
  }
  Eigen::Matrix<double, 12, 12> curvature;
  for (int k = 0; k < 4; ++k) {
    for (int l = 0; l < 4; ++l) {
      curvature.block<3, 3>(3 * k, 3 * l) = where.weights[static_cast<std::size_t>(k)] *
                                            where.weights[static_cast<std::size_t>(l)] * Eigen::Matrix3d::Identity();
    }
  }
  const Eigen::Matrix2d lengths = along.transpose() * along;
  constexpr double degenerate = 1e-10;  // square of a sine: such edges are parallel, and their nearest points any
  if (free == 2 && lengths.determinant() > degenerate * lengths(0, 0) * lengths(1, 1)) {
    curvature -= mixed * lengths.inverse() * mixed.transpose();
  } else if (free > 0 && lengths(0, 0) > 0) {
    curvature -= mixed.col(0) * mixed.col(0).transpose() / lengths(0, 0);
  }
  return (curvature - slope * slope.transpose() / (gap * gap)) / gap;
}

ContactPairs find_contact_pairs(const ContactMesh& mesh, const Eigen::Matrix3Xd& places, double stiffness) {
  return Search(mesh, places, stiffness).run();
}

}  // namespace contact
}  // namespace pellicle
