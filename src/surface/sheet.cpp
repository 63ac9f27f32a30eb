#include "surface/sheet.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "parallel/collective.h"

namespace pellicle::surface {

std::vector<double> corner_masses(const Sheet& sheet, const Field& mass) {
  Field sum(sheet.particles, 1);
  sum.values() = mass.values();
  const auto has_left = [&mass](PetscInt corner) { return mass.data()[corner] == 0; };
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    const std::array<PetscInt, 4>& corners = sheet.cells[cell];
    sum.data()[sheet.lattice[cell]] = 0;
    const auto left = std::count_if(corners.begin(), corners.end(), has_left);
    for (const PetscInt corner : corners) {
      if (!has_left(corner)) {
        sum.data()[corner] += mass.data()[sheet.lattice[cell]] / static_cast<double>(4 - left);
      }
    }
  }
  // All elements at an owned corner are local; a ghost misses some.
  sum.update_ghosts();
  return {sum.data(), sum.data() + sheet.particles.local()};
}

void follow_corners(const Sheet& sheet, Field& values) {
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    const auto& [a, b, c, d] = sheet.cells[cell];
    values.vector(sheet.lattice[cell]) =
        (values.vector(a) + values.vector(b) + values.vector(c) + values.vector(d)) / 4;
  }
}

void carry_removed_corners(const Sheet& sheet, const std::vector<bool>& active, const Field& mass,
                           const std::vector<bool>& pinned, Field& position, std::vector<bool>& carried) {
  constexpr int least = 3;  // particles that a rotation follows from
  carried.assign(sheet.particles.local(), false);
  const auto remains = [&mass](PetscInt particle) { return mass.data()[particle] > 0; };
  std::vector<PetscInt> quads;  // that have lost particles but not all triangles
  for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
    const std::array<PetscInt, 4>& corners = sheet.cells[cell];
    const auto triangles = active.begin() + 4 * cell;
    if (!std::all_of(corners.begin(), corners.end(), remains) &&
        std::find(triangles, triangles + 4, true) != triangles + 4) {
      quads.push_back(cell);
    }
  }
  if (!on_any_rank(sheet.comm(), !quads.empty())) {
    return;
  }
  Field places(sheet.particles, 4);  // their sum over the quads, and how many
  for (const PetscInt cell : quads) {
    const auto& [a, b, c, d] = sheet.cells[cell];
    std::array<PetscInt, 5> particles{a, b, c, d, sheet.lattice[cell]};
    const auto removed = std::stable_partition(particles.begin(), particles.end(), remains);
    const auto count = removed - particles.begin();
    if (count < least) {
      continue;
    }
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 5> rest(3, count);
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 5> now(3, count);
    for (Eigen::Index k = 0; k < count; ++k) {
      rest.col(k) = sheet.rest.col(particles[k]);
      now.col(k) = position.vector(particles[k]);
    }
    const Eigen::Matrix4d motion = Eigen::umeyama(rest, now);
    for (auto i = removed; i != particles.end(); ++i) {
      places.values().col(*i) += motion * Eigen::Vector3d(sheet.rest.col(*i)).homogeneous();
    }
  }
  places.add_ghosts();
  places.update_ghosts();
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const Eigen::Vector4d place = places.values().col(i);
    carried[i] = place[3] > 0 && !pinned[i];
    if (carried[i]) {
      position.vector(i) = place.hnormalized();
    }
  }
}

}  // namespace pellicle::surface
