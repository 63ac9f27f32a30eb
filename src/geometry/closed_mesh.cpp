#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "geometry/nearest_points.h"
#include "geometry/solids.h"

namespace pellicle::geometry {

std::string fault_of_closed_mesh(const std::vector<Eigen::Vector3d>& points, const Triangles& triangles) {
  if (triangles.empty()) {
    return "it has no faces";
  }
  std::map<std::pair<int, int>, int> sides;  // directed
  double volume = 0;
  for (const auto& triangle : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++sides[{triangle[k], triangle[(k + 1) % 3]}];
    }
    const auto at = [&](std::size_t k) -> const Eigen::Vector3d& { return points[triangle[k]]; };
    volume += (at(0) - points[0]).dot((at(1) - points[0]).cross(at(2) - points[0])) / 6;
  }
  for (const auto& [side, count] : sides) {
    const auto back = sides.find({side.second, side.first});
    const std::string name =
        "the side between points " + std::to_string(side.first) + " and " + std::to_string(side.second) + " has ";
    if (back == sides.end()) {
      return name + "a face on one side alone";
    }
    if (count != back->second) {
      return name + "faces whose normals do not agree";
    }
  }
  if (!(volume > 0)) {
    return "its normals point inward";
  }
  return "";
}

ClosedMesh::ClosedMesh(std::vector<Eigen::Vector3d> points, Triangles triangles)
    : points_(std::move(points)), vertex_normals_(points_.size(), Eigen::Vector3d::Zero()) {
  std::map<std::pair<int, int>, Eigen::Vector3d> of_sides;
  const auto side_of = [](int a, int b) { return std::pair(std::min(a, b), std::max(a, b)); };
  for (const auto& triangle : triangles) {
    const auto corner = [&](std::size_t k) { return points_[triangle[k % 3]]; };
    const Eigen::Vector3d across = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    if (!(across.norm() > 0)) {
      continue;  // a triangle without area: its sides have the normals of its neighbours
    }
    const Eigen::Vector3d normal = across.normalized();
    triangles_.push_back(triangle);
    face_normals_.push_back(normal);
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d to_next = corner(k + 1) - corner(k);
      const Eigen::Vector3d to_last = corner(k + 2) - corner(k);
      const double angle = std::atan2(to_next.cross(to_last).norm(), to_next.dot(to_last));
      vertex_normals_[triangle[k]] += angle * normal;
      of_sides.try_emplace(side_of(triangle[k], triangle[(k + 1) % 3]), Eigen::Vector3d::Zero()).first->second +=
          normal;
    }
  }
  for (const auto& triangle : triangles_) {
    const auto normal = [&](std::size_t k) { return of_sides.at(side_of(triangle[k], triangle[(k + 1) % 3])); };
    edge_normals_.push_back({normal(0), normal(1), normal(2)});
  }
  order_.resize(triangles_.size());
  std::iota(order_.begin(), order_.end(), 0);
  build(0, static_cast<int>(order_.size()));
}

/// Halves the triangles by their centres along the longest side of the box round them.
void ClosedMesh::build(int begin, int end) {
  constexpr int leaf_size = 4;
  const std::size_t number = nodes_.size();
  nodes_.push_back({{}, begin, end});
  Eigen::AlignedBox3d centres;
  const auto centre = [this](int triangle) {
    const auto& [a, b, c] = triangles_[triangle];
    return Eigen::Vector3d((points_[a] + points_[b] + points_[c]) / 3);
  };
  for (int i = begin; i < end; ++i) {
    const int triangle = order_[i];
    centres.extend(centre(triangle));
    for (const int point : triangles_[triangle]) {
      nodes_[number].box.extend(points_[point]);
    }
  }
  if (end - begin <= leaf_size) {
    return;
  }
  Eigen::Index axis = 0;
  centres.sizes().maxCoeff(&axis);
  const int middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](int a, int b) { return std::pair(centre(a)[axis], a) < std::pair(centre(b)[axis], b); });
  build(begin, middle);
  nodes_[number].second = static_cast<int>(nodes_.size());
  build(middle, end);
}

/// Outward direction at the corner, side or face on which a point of a triangle lies.
/// @param weights of the triangle's corners at 1 to 3, not all 0
const Eigen::Vector3d& ClosedMesh::normal_at(std::size_t triangle, const std::array<double, 4>& weights) const {
  for (std::size_t k = 0; k < 3; ++k) {
    const bool is_opposite = weights[1 + k] == 0;  // on the side opposite to corner k
    const std::size_t next = (k + 1) % 3;
    const std::size_t last = (k + 2) % 3;
    if (is_opposite && weights[1 + next] != 0 && weights[1 + last] != 0) {
      return edge_normals_[triangle][next];
    }
    if (!is_opposite && weights[1 + next] == 0 && weights[1 + last] == 0) {
      return vertex_normals_[triangles_[triangle][k]];
    }
  }
  return face_normals_[triangle];
}

SignedDistance ClosedMesh::distance(const Eigen::Vector3d& point) const {
  double least = std::numeric_limits<double>::infinity();  // squared
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();
  Eigen::Vector3d outward = Eigen::Vector3d::UnitZ();
  std::array<int, 64> stack{};  // as deep as the tree, which halves
  int depth = 1;
  while (depth > 0) {
    const int number = stack[--depth];
    const Node& node = nodes_[number];
    if (node.box.squaredExteriorDistance(point) >= least) {
      continue;
    }
    if (node.second > 0) {
      int near = number + 1;
      int far = node.second;
      if (nodes_[far].box.squaredExteriorDistance(point) < nodes_[near].box.squaredExteriorDistance(point)) {
        std::swap(near, far);
      }
      stack[depth++] = far;
      stack[depth++] = near;
      continue;
    }
    for (int i = node.begin; i < node.end; ++i) {
      const std::size_t triangle = order_[i];
      const auto& corners = triangles_[triangle];
      const NearestPoints found =
          nearest_of_point_and_triangle({point, points_[corners[0]], points_[corners[1]], points_[corners[2]]});
      if (const double squared = found.apart.squaredNorm(); squared < least) {
        least = squared;
        arm = found.apart;
        outward = normal_at(triangle, found.weights);
      }
    }
  }
  const double length = arm.norm();
  const double sign = arm.dot(outward) < 0 ? -1 : 1;
  // An arm no longer than the rounding of the places has no direction.
  const double rounding = 1e-12 * (1 + point.cwiseAbs().maxCoeff() + nodes_.front().box.sizes().maxCoeff());
  const Eigen::Vector3d normal =
      length > rounding ? Eigen::Vector3d(arm * (sign / length)) : Eigen::Vector3d(outward.normalized());
  return {sign * length, normal};
}

}  // namespace pellicle::geometry
