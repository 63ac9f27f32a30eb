#include "geometry/ear_clipping.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>

namespace pellicle::geometry {

namespace {

using Vector = Eigen::Vector2d;

/// Twice the area of a triangle, positive if it turns to the left.
double doubled_area(const Vector& a, const Vector& b, const Vector& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// The corners in the plane normal to the area vector, seen against it. None if there is no area.
std::vector<Vector> flattened(const std::vector<Eigen::Vector3d>& corners) {
  Eigen::Vector3d area = Eigen::Vector3d::Zero();
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    area += (corners[k] - corners[0]).cross(corners[k + 1] - corners[0]);
  }
  if (!(area.squaredNorm() > 0)) {
    return {};
  }
  const Eigen::Vector3d across = area.unitOrthogonal();
  const Eigen::Vector3d up = area.normalized().cross(across);
  std::vector<Vector> flat;
  for (const Eigen::Vector3d& corner : corners) {
    flat.emplace_back(across.dot(corner - corners[0]), up.dot(corner - corners[0]));
  }
  return flat;
}

/// Points in square boxes, about one a box.
class Grid {
 public:
  explicit Grid(const std::vector<Vector>& points) : points_(points) {
    Eigen::AlignedBox2d all;
    for (const Vector& point : points) {
      all.extend(point);
    }
    low_ = all.min();
    boxes_ = static_cast<int>(std::sqrt(static_cast<double>(points.size()))) + 1;
    spacing_ = std::max(all.sizes().maxCoeff() / boxes_, std::numeric_limits<double>::min());
    members_.resize(static_cast<std::size_t>(boxes_) * static_cast<std::size_t>(boxes_));
  }
  void add(std::size_t point) {
    members(box(points_[point].x(), 0), box(points_[point].y(), 1)).push_back(point);
    ++count_;
  }
  void remove(std::size_t point) {
    std::vector<std::size_t>& here = members(box(points_[point].x(), 0), box(points_[point].y(), 1));
    here.erase(std::find(here.begin(), here.end(), point));
    --count_;
  }
  /// Whether `wanted` holds for any of the points in the box round a triangle.
  template <class Wanted>
  bool any_near(const Vector& low, const Vector& high, const Wanted& wanted) const {
    if (count_ == 0) {
      return false;
    }
    for (int j = box(low.y(), 1); j <= box(high.y(), 1); ++j) {
      for (int i = box(low.x(), 0); i <= box(high.x(), 0); ++i) {
        const std::vector<std::size_t>& here = members_[index(i, j)];
        if (std::any_of(here.begin(), here.end(), wanted)) {
          return true;
        }
      }
    }
    return false;
  }

 private:
  int box(double coordinate, int axis) const {
    return std::clamp(static_cast<int>((coordinate - low_[axis]) / spacing_), 0, boxes_ - 1);
  }
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) + static_cast<std::size_t>(boxes_) * static_cast<std::size_t>(j);
  }
  std::vector<std::size_t>& members(int i, int j) { return members_[index(i, j)]; }

  const std::vector<Vector>& points_;
  Vector low_;
  int boxes_ = 1;
  double spacing_ = 1;
  std::vector<std::vector<std::size_t>> members_;
  std::size_t count_ = 0;
};

class EarCutter {
 public:
  explicit EarCutter(const std::vector<Vector>& corners)
      : corners_(corners), inward_(corners), bends_inward_(corners.size()) {
    const std::size_t count = corners.size();
    double longest = 0;
    for (std::size_t k = 0; k < count; ++k) {
      before_.push_back((k + count - 1) % count);
      after_.push_back((k + 1) % count);
      longest = std::max(longest, (corners[after_[k]] - corners[k]).squaredNorm());
    }
    flat_ = 1e-14 * longest;
    for (std::size_t k = 0; k < count; ++k) {
      bends_inward_[k] = !(area_at(k) > flat_);
      if (bends_inward_[k]) {
        inward_.add(k);
      }
    }
    queue_all();
  }

  std::vector<std::array<std::size_t, 3>> cut() {
    std::vector<std::array<std::size_t, 3>> triangles;
    for (std::size_t left = corners_.size(); left >= 3; --left) {
      const std::size_t ear = next_ear();
      if (ear == none) {
        return {};
      }
      triangles.push_back({before_[ear], ear, after_[ear]});
      after_[before_[ear]] = after_[ear];
      before_[after_[ear]] = before_[ear];
      after_[ear] = none;
      for (const std::size_t neighbour : {before_[ear], after_[before_[ear]]}) {
        if (bends_inward_[neighbour] && area_at(neighbour) > flat_) {
          bends_inward_[neighbour] = false;
          inward_.remove(neighbour);
        }
        queue(neighbour);
      }
    }
    return triangles;
  }

 private:
  static constexpr std::size_t none = static_cast<std::size_t>(-1);
  /// A corner, with the properties of its ear when it was queued.
  struct Candidate {
    double cut;  ///< squared length of the side that results from the cut
    std::size_t corner;
    std::size_t before;
    std::size_t after;
    bool operator>(const Candidate& other) const { return cut != other.cut ? cut > other.cut : corner > other.corner; }
  };

  double area_at(std::size_t k) const { return doubled_area(corners_[before_[k]], corners_[k], corners_[after_[k]]); }

  void queue(std::size_t k) {
    if (area_at(k) > flat_) {
      queue_.push({(corners_[after_[k]] - corners_[before_[k]]).squaredNorm(), k, before_[k], after_[k]});
    }
  }

  void queue_all() {
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      if (after_[k] != none) {
        queue(k);
      }
    }
  }

  /// The best corner to cut off. Corners whose ears contained others are tried again when no other is left.
  std::size_t next_ear() {
    for (int attempt = 0; attempt < 2; ++attempt) {
      while (!queue_.empty()) {
        const Candidate best = queue_.top();
        queue_.pop();
        const std::size_t k = best.corner;
        if (after_[k] == best.after && before_[k] == best.before && after_[k] != none && is_empty(k)) {
          return k;
        }
      }
      queue_all();
    }
    return none;
  }

  bool is_empty(std::size_t k) const {
    const std::size_t before = before_[k];
    const std::size_t after = after_[k];
    const Vector& a = corners_[before];
    const Vector& b = corners_[k];
    const Vector& c = corners_[after];
    return !inward_.any_near(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c), [&](std::size_t other) {
      const Vector& p = corners_[other];
      return other != before && other != k && other != after && doubled_area(a, b, p) >= 0 &&
             doubled_area(b, c, p) >= 0 && doubled_area(c, a, p) >= 0;
    });
  }

  const std::vector<Vector>& corners_;
  std::vector<std::size_t> before_;  ///< neighbours among the remaining corners
  std::vector<std::size_t> after_;   ///< none once a corner is cut off
  Grid inward_;                      ///< the corners that bend inward
  std::vector<bool> bends_inward_;
  double flat_ = 0;  ///< doubled areas below are rounding errors
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue_;
};

}  // namespace

std::vector<std::array<std::size_t, 3>> cut_ears(const std::vector<Eigen::Vector3d>& corners) {
  const std::vector<Vector> flat = flattened(corners);
  return flat.empty() ? std::vector<std::array<std::size_t, 3>>() : EarCutter(flat).cut();
}

}  // namespace pellicle::geometry
