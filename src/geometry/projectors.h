#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::geometry {

/// Orthogonal projectors on the directions in which vertices may move: I for most, which is stored once, I - n n^T and
/// so on, 0 for constrained ones.
class Projectors {
 public:
  Projectors() = default;
  /// All vertices are free.
  explicit Projectors(std::size_t vertices) : place_(vertices, 0) {}

  std::size_t size() const { return place_.size(); }
  const Eigen::Matrix3d& operator[](std::size_t vertex) const { return different_[place_[vertex]]; }
  bool is_free(std::size_t vertex) const { return place_[vertex] == 0; }
  /// The vertices that are not free, in the order in which they were bound.
  const std::vector<int>& bound() const { return bound_; }

  /// Binds a vertex, unless the projector is the identity. At most once for each vertex.
  void bind(std::size_t vertex, const Eigen::Matrix3d& projector) {
    if (projector != Eigen::Matrix3d::Identity()) {
      place_[vertex] = static_cast<unsigned>(different_.size());
      different_.push_back(projector);
      bound_.push_back(static_cast<int>(vertex));
    }
  }

  /// Projects vectors on the directions in which vertices may move. @param vectors (3 x n) of the first n vertices
  void apply(Eigen::Ref<Eigen::Matrix3Xd> vectors) const {
    for (const int i : bound_) {
      if (i < vectors.cols()) {
        vectors.col(i) = ((*this)[i] * vectors.col(i)).eval();
      }
    }
  }

  /// Adds free vertices, or removes the last ones, which must have been bound last.
  void resize(std::size_t vertices) {
    while (!bound_.empty() && static_cast<std::size_t>(bound_.back()) >= vertices) {
      bound_.pop_back();
      different_.pop_back();
    }
    place_.resize(vertices, 0);
  }

 private:
  std::vector<unsigned> place_;                                          ///< index of each vertex in different_
  std::vector<Eigen::Matrix3d> different_{Eigen::Matrix3d::Identity()};  ///< identity, then those of the bound vertices
  std::vector<int> bound_;
};

}  // namespace pellicle::geometry
