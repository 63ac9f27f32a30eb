#include "geometry/box_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace pellicle::geometry {

namespace {

constexpr int most_of_leaf = 4;

/// Bounds of the errors of rounding to floats.
Eigen::Array3f rounding(const Eigen::Array3f& values) {
  return values.abs() * std::numeric_limits<float>::epsilon() + std::numeric_limits<float>::min();
}

}  // namespace

Bounds::Bounds(const Eigen::AlignedBox3d& box) {
  const Eigen::Array3f least = box.min().cast<float>();
  const Eigen::Array3f greatest = box.max().cast<float>();
  low.head<3>() = least - rounding(least);
  high.head<3>() = greatest + rounding(greatest);
}

BoxTree::BoxTree(const std::vector<Bounds>& boxes) : bounds_(boxes.size()), numbers_(boxes.size()) {
  if (boxes.empty()) {
    return;
  }
  std::iota(numbers_.begin(), numbers_.end(), 0);
  std::vector<Eigen::Array4f> middles;
  middles.reserve(boxes.size());
  for (const Bounds& box : boxes) {
    middles.emplace_back((box.low + box.high) / 2);
  }
  nodes_.reserve(boxes.size());
  build(0, static_cast<int>(boxes.size()), middles);
  move_to(boxes);
}

void BoxTree::move_to(const std::vector<Bounds>& boxes) {
  std::transform(numbers_.begin(), numbers_.end(), bounds_.begin(), [&boxes](int number) { return boxes[number]; });
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {  // Children come behind their parents.
    if (node->is_leaf()) {
      node->bounds = bounds_[node->first];
      std::for_each(bounds_.begin() + node->first, bounds_.begin() + node->end,
                    [&node](const Bounds& box) { node->bounds.extend(box); });
    } else {
      node->bounds = this->node(node->left).bounds.merged(this->node(node->right).bounds);
    }
  }
}

/// Builds the part of the tree for the items from `first` on, which it sorts. @returns the node
int BoxTree::build(int first, int end, const std::vector<Eigen::Array4f>& middles) {
  const auto of = static_cast<int>(nodes_.size());
  nodes_.push_back({{}, first, end, -1, -1});
  if (end - first <= most_of_leaf) {
    return of;
  }
  const auto middle = [&](int item) -> const Eigen::Array4f& { return middles[numbers_[item]]; };
  Eigen::Array4f low = middle(first);
  Eigen::Array4f high = low;
  for (int i = first; i < end; ++i) {
    low = low.min(middle(i));
    high = high.max(middle(i));
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const int half = first + (end - first) / 2;
  std::nth_element(numbers_.begin() + first, numbers_.begin() + half, numbers_.begin() + end,
                   [&](int a, int b) { return middles[a][axis] < middles[b][axis]; });
  const int left = build(first, half, middles);
  const int right = build(half, end, middles);
  nodes_[of].left = left;
  nodes_[of].right = right;
  return of;
}

}  // namespace pellicle::geometry
