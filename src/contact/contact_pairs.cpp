#include "contact/contact_pairs.h"

#include <algorithm>
#include <cmath>

#include "contact/crack_faces.h"

namespace pellicle::contact {

namespace {

/// Undeformed distances below twice this fraction of the thickness count as zero.
constexpr double least_share = 1e-3;
/// Share of the thickness below which the barrier without bound acts.
constexpr double steep_share = 0.1;
/// Distances below this fraction of the thickness are rounding: they do not tell on which side of each other features
/// are.
constexpr double none = 1e-10;
/// Sine of the angle up to which edges count as nearly parallel, unless contacts are thinner than that times their
/// lengths: there what presses would be further than the thickness from where the edges cross.
constexpr double nearly_parallel = 0.1;

/// Looks for pairs of features of surface triangles. One triangle stands for each point and side, so that each pair
/// comes once.
class Search {
 public:
  Search(const ContactMesh& mesh, const Eigen::Matrix3Xd& places) : mesh_(mesh), places_(places) {}

  /// @returns whether features touch
  bool refresh(std::vector<ContactPair>& pairs) {
    pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                               [this](ContactPair& pair) {
                                 if (any_of(pair.points, &ContactMesh::Point::is_new)) {
                                   return true;
                                 }
                                 const double nearest = measure(pair);
                                 return !is_near(pair, nearest) || !matters(pair, nearest);
                               }),
                pairs.end());
    std::vector<bool> marked;
    std::vector<bool> touches_own;
    for (const std::array<PetscInt, 3>& triangle : mesh_.triangles()) {
      marked.push_back(any_of(triangle, &ContactMesh::Point::is_new));
      touches_own.push_back(any_of(triangle, &ContactMesh::Point::is_own));
    }
    mesh_.tree().visit_pairs_of(marked, [&](int a, int b) {
      if (touches_own[a] || touches_own[b]) {
        add_triangles(static_cast<std::size_t>(std::min(a, b)), static_cast<std::size_t>(std::max(a, b)), pairs);
      }
    });
    return any_touch_;
  }

 private:
  template <std::size_t N>
  bool any_of(const std::array<PetscInt, N>& points, bool ContactMesh::Point::*are) const {
    return std::any_of(points.begin(), points.end(), [&](PetscInt point) { return mesh_.point(point).*are; });
  }

  const Bounds& box(PetscInt point) const { return mesh_.point(point).box; }

  void add_triangles(std::size_t first, std::size_t second, std::vector<ContactPair>& pairs) {
    add_points(first, second, pairs);
    add_points(second, first, pairs);
    const std::array<PetscInt, 3>& a = mesh_.triangles()[first];
    const std::array<PetscInt, 3>& b = mesh_.triangles()[second];
    for (std::size_t k = 0; k < 3; ++k) {
      if (!mesh_.leads()[first].side[k]) {
        continue;
      }
      const std::array<PetscInt, 2> side{a[k], a[(k + 1) % 3]};
      const Bounds whole = box(side[0]).merged(box(side[1]));
      const auto ends_at = [&side](PetscInt point) { return point == side[0] || point == side[1]; };
      for (std::size_t l = 0; l < 3; ++l) {
        const std::array<PetscInt, 2> other{b[l], b[(l + 1) % 3]};
        if (mesh_.leads()[second].side[l] && !ends_at(other[0]) && !ends_at(other[1]) &&
            whole.meets(box(other[0]).merged(box(other[1])))) {
          add({side[0], side[1], other[0], other[1]}, true, pairs);
        }
      }
    }
  }

  void add_points(std::size_t of, std::size_t other, std::vector<ContactPair>& pairs) {
    const auto [a, b, c] = mesh_.triangles()[other];
    for (std::size_t k = 0; k < 3; ++k) {
      const PetscInt point = mesh_.triangles()[of][k];
      if (mesh_.leads()[of].point[k] && point != a && point != b && point != c &&
          box(point).meets(mesh_.boxes()[other])) {
        add({point, a, b, c}, false, pairs);
      }
    }
  }

  void add(const std::array<PetscInt, 4>& points, bool are_edges, std::vector<ContactPair>& pairs) {
    if (!any_of(points, &ContactMesh::Point::is_new) || !any_of(points, &ContactMesh::Point::is_own)) {
      return;
    }
    ContactPair pair;
    pair.points = points;
    pair.are_edges = are_edges;
    const double nearest = measure(pair);
    if (!is_near(pair, nearest)) {
      any_touch_ = any_touch_ || touches(pair);
      return;
    }
    const double thickness = thickness_of(pair);
    pair.barrier.thickness = thickness_at_rest(pair, thickness);
    const bool are_lips = pair.barrier.thickness < least_share * thickness;
    if (are_lips) {
      pair.barrier.thickness = lip_share * thickness;
    }
    pair.barrier.steep = steep_share;
    if (!matters(pair, nearest)) {
      return;
    }
    const double stiffness = std::min(mesh_.point(points[0]).stiffness, mesh_.point(points[2]).stiffness);
    // The crack faces of a crack have less of a gap to press in, and few pairs to resist being pushed together in the
    // sheet's plane.
    const double fraction =
        (are_lips ? 1 / (lip_share * lip_share) : 1) * (are_edges ? share_of_edges(points, pair.barrier.thickness) : 1);
    const auto area = [&](std::size_t k) { return mesh_.point(points[k]).area; };
    pair.barrier.stiffness =
        fraction * stiffness * (are_edges ? (area(0) + area(1) + area(2) + area(3)) / 16 : area(0) / 2);
    pairs.push_back(pair);
  }

  double thickness_of(const ContactPair& pair) const {
    return (mesh_.point(pair.points[0]).thickness + mesh_.point(pair.points[2]).thickness) / 2;
  }

  /// @returns the least distance that the features can reach
  double measure(ContactPair& pair) const {
    pair.measure(places_);
    return pair.distance - closing(pair);
  }

  /// Whether features are apart by more than rounding and may come nearer than the thickness.
  bool is_near(const ContactPair& pair, double nearest) const {
    const double thickness = thickness_of(pair);
    return pair.distance > none * thickness && nearest < thickness;
  }

  /// Whether features are at distance 0 though no point of one is in the place of a point of the other.
  bool touches(const ContactPair& pair) const {
    const double rounding = none * thickness_of(pair);
    if (pair.distance > rounding) {
      return false;
    }
    const auto first = pair.points.begin() + pair.first_feature();
    return std::none_of(pair.points.begin(), first, [&](PetscInt one) {
      return std::any_of(first, pair.points.end(),
                         [&](PetscInt other) { return (places_.col(one) - places_.col(other)).norm() <= rounding; });
    });
  }

  /// Whether a pair may press, or use up its clearance.
  static bool matters(ContactPair& pair, double nearest) {
    pair.may_press = nearest < pair.barrier.thickness;
    return pair.may_press || nearest < (1 - room_share) * pair.distance;
  }

  /// Largest approach of two features along their normal within their ranges.
  double closing(const ContactPair& pair) const {
    Eigen::Array4d of_points;
    for (int k = 0; k < 4; ++k) {
      const ContactMesh::Point& point = mesh_.point(pair.points[k]);
      const Eigen::Vector3d with = pair.normal.cwiseProduct(point.high);
      const Eigen::Vector3d against = pair.normal.cwiseProduct(point.low);
      of_points[k] = pair.is_second(k) ? with.cwiseMax(against).sum() : -with.cwiseMin(against).sum();
    }
    return pair.largest(of_points).sum();
  }

  /// Share of stiffness of two edges. Parallel edges have many nearest points, of which an arbitrary one is found, so
  /// edges press the less, the nearer they are to parallel at the step's start (points and triangles press instead).
  double share_of_edges(const std::array<PetscInt, 4>& points, double thickness) const {
    const Eigen::Vector3d first = mesh_.point(points[1]).start - mesh_.point(points[0]).start;
    const Eigen::Vector3d second = mesh_.point(points[3]).start - mesh_.point(points[2]).start;
    const double lengths = first.squaredNorm() * second.squaredNorm();
    if (lengths == 0) {
      return 0;
    }
    const double least_sine =
        std::min(nearly_parallel, thickness / std::sqrt(std::max(first.squaredNorm(), second.squaredNorm())));
    const double c = first.cross(second).squaredNorm() / (least_sine * least_sine * lengths);
    return c < 1 ? c * (2 - c) : 1;
  }

  /// The thickness, or half of the undeformed distance of features if that is less. As most are further apart than
  /// twice the thickness, their boxes are looked at first.
  double thickness_at_rest(const ContactPair& pair, double thickness) const {
    std::array<Eigen::Vector3d, 4> corners;
    std::array<Eigen::AlignedBox3d, 2> boxes;
    for (int k = 0; k < 4; ++k) {
      corners[k] = mesh_.point(pair.points[k]).rest;
      boxes[pair.is_second(k)].extend(corners[k]);
    }
    const bool are_far = boxes[0].squaredExteriorDistance(boxes[1]) > 4 * thickness * thickness;
    return are_far ? thickness : std::min(thickness, pair.nearest_of(corners).apart.norm() / 2);
  }

  const ContactMesh& mesh_;
  const Eigen::Matrix3Xd& places_;
  bool any_touch_ = false;
};

}  // namespace

// Half of the squared gap is the minimum of f = |r|^2 / 2, r = sum_k s_k x_k, over the weights s: only those that are
// not 0 change, and those of each feature keep their sum. With the free changes a of the weights the second derivative
// is f_xx - f_xa f_aa^-1 f_ax.
Eigen::Matrix<double, 12, 12> ContactPair::gap_curvature(const Eigen::Matrix3Xd& places) const {
  const NearestPoints where = nearest(places);
  const double gap = where.apart.norm();
  Eigen::Matrix<double, 12, 2> mixed;                                         // f_xa
  Eigen::Matrix<double, 3, 2> along = Eigen::Matrix<double, 3, 2>::Zero();    // r_a
  Eigen::Matrix<double, 4, 2> changes = Eigen::Matrix<double, 4, 2>::Zero();  // s_a
  int free = 0;
  for (const auto& [first, last] : {std::pair(0, first_feature()), std::pair(first_feature(), 4)}) {
    int base = -1;
    for (int k = first; k < last; ++k) {
      if (where.weights[k] != 0 && base < 0) {
        base = k;
      } else if (where.weights[k] != 0) {
        changes(k, free) = 1;
        changes(base, free) = -1;
        along.col(free) = places.col(points[k]) - places.col(points[base]);
        ++free;
      }
    }
  }
  Eigen::Matrix<double, 12, 1> slope;  // f_x
  for (int k = 0; k < 4; ++k) {
    const double weight = where.weights[k];
    slope.segment<3>(3 * k) = weight * where.apart;
    mixed.middleRows<3>(3 * k) = where.apart * changes.row(k) + weight * along;
  }
  Eigen::Matrix<double, 12, 12> curvature;
  for (int k = 0; k < 4; ++k) {
    for (int l = 0; l < 4; ++l) {
      curvature.block<3, 3>(3 * k, 3 * l) = where.weights[k] * where.weights[l] * Eigen::Matrix3d::Identity();
    }
  }
  const Eigen::Matrix2d lengths = along.transpose() * along;
  constexpr double degenerate = 1e-10;  // square of a sine: such edges are parallel, and any nearest points will do
  if (free == 2 && lengths.determinant() > degenerate * lengths(0, 0) * lengths(1, 1)) {
    curvature -= mixed * lengths.inverse() * mixed.transpose();
  } else if (free > 0 && lengths(0, 0) > 0) {
    curvature -= mixed.col(0) * mixed.col(0).transpose() / lengths(0, 0);
  }
  return (curvature - slope * slope.transpose() / (gap * gap)) / gap;
}

bool renew_contact_pairs(const ContactMesh& mesh, const Eigen::Matrix3Xd& places, std::vector<ContactPair>& pairs) {
  return Search(mesh, places).refresh(pairs);
}

}  // namespace pellicle::contact
