#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <unsupported/Eigen/BVH>
#include <vector>

#include "base/sorting.h"

namespace pellicle::meshing {

using Box = Eigen::AlignedBox3d;

/// The visitor of Eigen's traversal of two trees of boxes, whose functions have Eigen's names.
template <class Take>
struct BoxPairVisitor {
  const std::vector<Box>& first;
  const std::vector<Box>& second;
  const Take& take;
  std::int64_t left;  ///< remaining comparisons of boxes

  // NOLINTBEGIN(readability-identifier-naming)
  /// Whether to descend from a pair of nodes: not if no comparisons are left, which ends the traversal.
  bool intersectVolumeVolume(const Box& a, const Box& b) { return left-- > 0 && a.intersects(b); }
  bool intersectVolumeObject(const Box& a, int b) { return intersectVolumeVolume(a, second[b]); }
  bool intersectObjectVolume(int a, const Box& b) { return intersectVolumeVolume(first[a], b); }
  /// Stops the traversal when no comparisons are left.
  bool intersectObjectObject(int a, int b) {
    if (left-- <= 0) {
      return true;
    }
    if (first[a].intersects(second[b])) {
      left -= take(a, b);
    }
    return false;
  }
  // NOLINTEND(readability-identifier-naming)
};

/// Calls `take` with the numbers of each box of the first and of the second that meet, in any order; if both lists are
/// the same, each pair comes in both orders, and each box with itself. By trees, in n log n for items spread over a
/// surface; if nearly all boxes meet it ends after some hundred comparisons for each, and at least 10^8.
/// @param take returns its work, in comparisons of boxes
/// @returns whether all pairs were visited
template <class Take>
bool visit_pairs(const std::vector<Box>& first, const std::vector<Box>& second, const Take& take) {
  using Tree = Eigen::KdBVH<double, 3, int>;
  const auto tree_of = [](const std::vector<Box>& boxes) {
    const std::vector<int> numbers = numbers_up_to(boxes.size());
    return Tree(numbers.begin(), numbers.end(), boxes.begin(), boxes.end());
  };
  if (first.empty() || second.empty()) {
    return true;
  }
  constexpr std::int64_t least = 100000000;
  constexpr std::int64_t of_a_box = 300;
  const auto larger = static_cast<std::int64_t>(std::max(first.size(), second.size()));
  BoxPairVisitor<Take> visitor{first, second, take, std::max(least, of_a_box * larger)};
  const Tree tree = tree_of(first);
  std::optional<Tree> other;
  if (&second != &first) {
    other.emplace(tree_of(second));
  }
  Eigen::BVIntersect(tree, other ? *other : tree, visitor);
  return visitor.left > 0;
}

}  // namespace pellicle::meshing
