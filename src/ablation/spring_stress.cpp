#include "ablation/spring_stress.h"

#include <algorithm>

#include "surface/drawn_surface.h"

namespace pellicle::ablation {

namespace {

enum SumRow { stress_sum = 0, active_cells = 9, sum_rows };

/// Active fraction of a cell, in quarters.
double active_share(const ActiveSet& active, std::size_t cell) {
  const auto first = active.triangles.begin() + static_cast<std::ptrdiff_t>(4 * cell);
  return static_cast<double>(std::count(first, first + 4, true)) / 4;
}

}  // namespace

SpringStress::SpringStress(const Sheet& sheet)
    : sheet_(sheet), particle_sums_(sheet.particles, sum_rows), stress_(sheet.cells.size()) {}

const std::vector<Eigen::Matrix3d>& SpringStress::find(const ActiveSet& active,
                                                       const std::array<std::vector<double>, 4>& force,
                                                       const Field& position) {
  Field::Values sums = particle_sums_.values();
  sums.setZero();
  for (std::size_t colour = 0; colour < sheet_.springs.size(); ++colour) {
    const SpringSet& set = sheet_.springs[colour];
    for (PetscInt s = 0; s < set.owned(); ++s) {
      const auto [a, b] = set.ends[s];
      if (active.springs[colour][s]) {
        const Eigen::Vector3d d = (position.vector(b) - position.vector(a)).stableNormalized();
        const Eigen::Matrix3d half = force[colour][s] * set.initial_length[s] / 2 * d * d.transpose();
        sums.col(a).head<9>() += half.reshaped();
        sums.col(b).head<9>() += half.reshaped();
      }
    }
  }
  for (PetscInt cell = 0; cell < sheet_.elements.owned; ++cell) {
    for (const PetscInt corner : sheet_.cells[cell]) {
      sums(active_cells, corner) += active_share(active, cell);
    }
  }
  particle_sums_.add_ghosts();
  particle_sums_.update_ghosts();

  for (std::size_t cell = 0; cell < stress_.size(); ++cell) {
    stress_[cell].setZero();
    const double fraction = active_share(active, cell);
    if (fraction > 0) {
      auto sum = stress_[cell].reshaped();
      sum += sums.col(sheet_.lattice[cell]).head<9>();
      for (const PetscInt corner : sheet_.cells[cell]) {
        sum += fraction / sums(active_cells, corner) * sums.col(corner).head<9>();
      }
      stress_[cell] /= fraction * element_area_vector(sheet_, sheet_.rest.data(), cell).norm();
    }
  }
  return stress_;
}

}  // namespace pellicle::ablation
