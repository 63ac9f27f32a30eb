#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::geometry {

/// A box in floats, rounded outwards.
struct Bounds {
  Eigen::Array4f low = Eigen::Array4f::Zero();  ///< the last is 0
  Eigen::Array4f high = Eigen::Array4f::Zero();

  Bounds() = default;
  explicit Bounds(const Eigen::AlignedBox3d& box);
  void extend(const Bounds& other) {
    low = low.min(other.low);
    high = high.max(other.high);
  }
  Bounds merged(Bounds other) const {
    other.extend(*this);
    return other;
  }
  bool meets(const Bounds& other) const { return (other.high - low).min(high - other.low).minCoeff() >= 0; }
};

/// Finds which of many boxes meet: a binary tree of bounding boxes, halved along the longest side of their middles, in
/// n log n. A pair may be found that is apart by rounding; whether it is found depends on its two boxes alone.
class BoxTree {
 public:
  BoxTree() = default;
  explicit BoxTree(const std::vector<Bounds>& boxes);

  /// Updates the tree after small motions of the boxes; its shape is kept.
  /// @param boxes as many as before
  void move_to(const std::vector<Bounds>& boxes);

  /// Calls `take` with the numbers of every two boxes that meet, once, in any order.
  template <class Take>
  void visit_pairs(const Take& take) const {
    if (!nodes_.empty()) {
      visit_between(
          0, 0, [](int) { return true; }, take);
    }
  }
  /// Calls `take` for every two boxes that meet and of which at least one is marked.
  template <class Take>
  void visit_pairs_of(const std::vector<bool>& marked, const Take& take) const {
    if (nodes_.empty()) {
      return;
    }
    const auto is_marked = [&marked](int box) { return marked[box]; };
    std::vector<bool> holds_marked(nodes_.size());
    const auto holds = [&holds_marked](int of) { return holds_marked[of]; };
    for (auto of = static_cast<int>(nodes_.size()) - 1; of >= 0; --of) {  // Children come behind their parents.
      const Node& whole = node(of);
      holds_marked[of] = whole.is_leaf()
                             ? std::any_of(numbers_.begin() + whole.first, numbers_.begin() + whole.end, is_marked)
                             : holds(whole.left) || holds(whole.right);
    }
    visit_between(0, 0, holds, [&](int a, int b) {
      if (is_marked(a) || is_marked(b)) {
        take(a, b);
      }
    });
  }

 private:
  struct Node {
    Bounds bounds;
    int first = 0;  ///< of the items below
    int end = 0;
    int left = -1;  ///< child; -1: none, a leaf
    int right = -1;
    bool is_leaf() const { return left < 0; }
  };
  const Node& node(int number) const { return nodes_[number]; }

  int build(int first, int end, const std::vector<Eigen::Array4f>& middles);

  /// Visits the pairs of an item of one node and one of another, or of two items of the same node.
  /// @param counts whether a node holds boxes to be visited
  template <class Counts, class Take>
  void visit_between(int of_one, int of_other, const Counts& counts, const Take& take) const {
    const bool is_same = of_one == of_other;
    const Node& one = node(of_one);
    const Node& other = node(of_other);
    if ((!is_same && !one.bounds.meets(other.bounds)) || !(counts(of_one) || counts(of_other))) {
      return;
    }
    if (one.is_leaf() && other.is_leaf()) {
      for (int i = one.first; i < one.end; ++i) {
        for (int j = is_same ? i + 1 : other.first; j < other.end; ++j) {
          if (bounds_[i].meets(bounds_[j])) {
            take(numbers_[i], numbers_[j]);
          }
        }
      }
    } else if (is_same) {
      visit_between(one.left, one.left, counts, take);
      visit_between(one.right, one.right, counts, take);
      visit_between(one.left, one.right, counts, take);
    } else if (other.is_leaf() || (!one.is_leaf() && one.end - one.first >= other.end - other.first)) {
      visit_between(one.left, of_other, counts, take);
      visit_between(one.right, of_other, counts, take);
    } else {
      visit_between(of_one, other.left, counts, take);
      visit_between(of_one, other.right, counts, take);
    }
  }

  std::vector<Node> nodes_;     ///< the root first
  std::vector<Bounds> bounds_;  ///< of the items, leaf after leaf
  std::vector<int> numbers_;    ///< of the items' boxes
};

}  // namespace pellicle::geometry
