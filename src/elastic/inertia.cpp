#include "elastic/inertia.h"

namespace pellicle {
inline namespace elastic {

Inertia::Inertia(const Layout& vertices) : vertices_(vertices), free_(Eigen::Matrix3Xd::Zero(3, vertices.owned)) {
  rows_.entries.assign(vertices.owned, 0);
  rows_.columns.reserve(rows_.entries.size());
  rows_.offsets.reserve(rows_.entries.size() + 1);
  for (PetscInt i = 0; i < vertices.owned; ++i) {
    rows_.columns.push_back(i);
    rows_.offsets.push_back(i + 1);
  }
}

double Inertia::value(const Field& x) const {
  double sum = 0;
  for (PetscInt i = 0; i < vertices_.owned; ++i) {
    sum += rows_.entries[i] * (x.vector(i) - free_.col(i)).squaredNorm();
  }
  return sum / 2;
}

double Inertia::add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  double sum = 0;
  for (PetscInt i = 0; i < vertices_.owned; ++i) {
    const double stiffness = rows_.entries[i];
    const Eigen::Vector3d away = x.vector(i) - free_.col(i);
    gradient.col(i) += stiffness * away;
    sum += stiffness * away.squaredNorm();
  }
  return sum / 2;
}

std::vector<VertexPair> Inertia::pattern() const {
  std::vector<VertexPair> pairs;
  for (PetscInt i = 0; i < vertices_.owned; ++i) {
    pairs.push_back({i, vertices_.to_global(i)});
  }
  return pairs;
}

void Inertia::add_hessian(const HessianBlocks& blocks) const {
  for (std::size_t i = 0; i < rows_.entries.size(); ++i) {
    blocks.add(i, rows_.entries[i] * Eigen::Matrix3d::Identity());
  }
}

}  // namespace elastic
}  // namespace pellicle
