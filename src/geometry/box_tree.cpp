#include "geometry/box_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace pellicle {
inline namespace geometry {

namespace {

constexpr int most_of_leaf = 4;
constexpr float infinity = std::numeric_limits<float>::infinity();

/// More than what rounding a number to a float changes.
float rounding(float value) {
  return std::abs(value) * std::numeric_limits<float>::epsilon() + std::numeric_limits<float>::min();
}

}  // namespace

Bounds::Bounds(const Eigen::AlignedBox3d& box) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = static_cast<float>(box.min()[static_cast<Eigen::Index>(k)]);
    high[k] = static_cast<float>(box.max()[static_cast<Eigen::Index>(k)]);
    low[k] -= rounding(low[k]);
    high[k] += rounding(high[k]);
  }
}

BoxTree::BoxTree(const std::vector<Eigen::AlignedBox3d>& boxes) : bounds_(boxes.size()), numbers_(boxes.size()) {
  std::iota(numbers_.begin(), numbers_.end(), 0);
  std::vector<std::array<float, 3>> middles(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      middles[i][k] = static_cast<float>(boxes[i].center()[static_cast<Eigen::Index>(k)]);
    }
  }
  if (boxes.empty()) {
    return;
  }
  nodes_.reserve(boxes.size());
  build(0, static_cast<int>(boxes.size()), middles);
  move_to(boxes);
}

void BoxTree::move_to(const std::vector<Eigen::AlignedBox3d>& boxes) {
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    bounds_[i] = Bounds(boxes[static_cast<std::size_t>(numbers_[i])]);
  }
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {  // Children come behind their parents.
    node->bounds = node->is_leaf() ? bounds(node->first) : this->node(node->left).bounds;
    const auto extend = [&](const Bounds& other) {
      for (std::size_t k = 0; k < 3; ++k) {
        node->bounds.low[k] = std::min(node->bounds.low[k], other.low[k]);
        node->bounds.high[k] = std::max(node->bounds.high[k], other.high[k]);
      }
    };
    if (node->is_leaf()) {
      std::for_each(bounds_.begin() + node->first, bounds_.begin() + node->end, extend);
    } else {
      extend(this->node(node->right).bounds);
    }
  }
}

/// Builds the part of the tree for the items from `first` on, which it sorts. @returns the node
int BoxTree::build(int first, int end, const std::vector<std::array<float, 3>>& middles) {
  const auto of = static_cast<int>(nodes_.size());
  nodes_.push_back({{}, first, end, -1, -1});
  if (end - first <= most_of_leaf) {
    return of;
  }
  std::array<float, 3> low;
  std::array<float, 3> high;
  low.fill(infinity);
  high.fill(-infinity);
  for (int i = first; i < end; ++i) {
    const std::array<float, 3>& middle = middles[static_cast<std::size_t>(number(i))];
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], middle[k]);
      high[k] = std::max(high[k], middle[k]);
    }
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
  }
  const int half = first + (end - first) / 2;
  std::nth_element(numbers_.begin() + first, numbers_.begin() + half, numbers_.begin() + end, [&](int a, int b) {
    return middles[static_cast<std::size_t>(a)][axis] < middles[static_cast<std::size_t>(b)][axis];
  });
  const int left = build(first, half, middles);
  const int right = build(half, end, middles);
  nodes_[static_cast<std::size_t>(of)].left = left;
  nodes_[static_cast<std::size_t>(of)].right = right;
  return of;
}

}  // namespace geometry
}  // namespace pellicle
