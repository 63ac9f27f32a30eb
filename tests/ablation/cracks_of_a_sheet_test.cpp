#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "ablation/cracks.h"
#include "tests/ablation/sheets.h"

namespace pellicle::cracks_of_a_sheet_test {
namespace {

constexpr double strength = 100;  // [N/m]

using Sides = std::vector<std::array<PetscInt, 2>>;

/// The ids of the ends of the sides that crack, of all ranks, where each cell is pulled in a direction and with a
/// stress that look random but follow from its id and a number. Collective.
Sides cracks_under_random_stress(MPI_Comm comm, int number) {
  const Sheet sheet = shell_of(grid_mesh(9, 7, 0.1), comm);
  std::vector<Eigen::Matrix3d> stress;
  for (const PetscInt id : sheet.element_id) {
    const double angle = std::sin(12.9 * id + 78.2 * number) * 1000;
    const Eigen::Vector3d along(std::cos(angle), std::sin(angle), 0);
    stress.emplace_back(strength * (1.5 + std::sin(31 * angle)) * along * along.transpose());
  }
  AblationOptions options;
  options.strength = strength;
  options.strength_length = 0;
  const ActiveSet active(sheet);
  Field position(sheet.particles, 3);
  position.values() = sheet.rest;
  const Field mass = initial_masses(sheet);
  const std::vector<bool> pinned(sheet.initial_mass.size(), false);
  Cracks cracks(sheet, options, {});
  Sides own;
  for (const PetscInt side : cracks.sides({active, stress, position, mass, pinned, 0.5})) {
    const auto [low, high] = ids_of(sheet, Colour::blue, side);
    own.push_back({low, high});
  }
  return gathered(comm, own);
}

TEST(CracksOfASheet, AreTheSameOnAnyRanks) {
  std::size_t count = 0;
  for (int number = 0; number < 100; ++number) {
    const Sides expected = cracks_under_random_stress(PETSC_COMM_SELF, number);
    EXPECT_EQ(cracks_under_random_stress(PETSC_COMM_WORLD, number), expected) << "stresses " << number;
    count += expected.size();
  }
  EXPECT_GT(count, 300U);
}

}  // namespace
}  // namespace pellicle::cracks_of_a_sheet_test
