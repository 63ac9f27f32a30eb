// How well an unburnt sheet that hangs keeps its lengths.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/alone.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/print_once.h"
#include "tests/support/solver_options.h"

namespace pellicle::inextensibility_test {
namespace {

constexpr int cells = 10;

/// Many small solves, for which several ranks only wait for each other.
class Inextensibility : public ::testing::Test {
 protected:
  void SetUp() override {
    if (ranks() > 1) {
      GTEST_SKIP() << "on one rank only";
    }
  }
};

/// A square sheet of 1 m constrained by two corners, which come 10 cm nearer to each other in the first half second.
Options hanging_options() {
  Options options;
  options.dynamics = Dynamics::projection;
  options.sheet.thickness = 0.25 / cells;
  options.heat.diffusivity = 0;
  options.pins["left"].vertices = {0};
  options.pins["left"].path = {{0, 0, 0, 0}, {0.5, 0.05, 0, 0}};
  options.pins["right"].vertices = {cells};
  options.pins["right"].path = {{0, 0, 0, 0}, {0.5, -0.05, 0, 0}};
  return options;
}

/// Largest |strain| of each colour after one second. Collective.
std::array<double, 4> strains_when_hung(const std::string& name, const Options& options) {
  Alone sheet(grid_mesh(cells, cells, 1.0 / cells), options);
  while (sheet.state().time < 1 - 1e-9) {
    const AloneStep step = sheet.advance(0.005);
    EXPECT_TRUE(step.converged) << step.reason;
    if (!step.converged) {
      return {};
    }
  }
  const std::array<double, 4> largest = sheet.object.last_step().strain->largest_of;
  double lowest = 0;
  for (PetscInt i = 0; i < sheet.sheet().owned_corners; ++i) {
    lowest = std::min(lowest, sheet.state().position.vector(i).z());
  }
  MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPI_DOUBLE, MPI_MIN, PETSC_COMM_WORLD);
  print_once("hung sheet, %s: largest strain red %.2g green %.2g blue %.2g yellow %.2g, lowest point %.3f m\n",
             name.c_str(), largest[0], largest[1], largest[2], largest[3], lowest);
  return largest;
}

TEST_F(Inextensibility, SingleLayerKeepsItsLengthsToATenthOfAPercent) {
  for (const double shift : {0.0, 1e-2}) {
    for (const int steps : {7, 30}) {
      Options options = hanging_options();
      options.project.weight = {0, 0, 1, 0};  // Blue springs alone: no sets that contradict each other.
      options.project.error_limit = 1e6;      // The lattice points fall away, and their springs count too.
      options.project.max_steps = steps;
      options.project.shift = shift;
      const auto strain = strains_when_hung(
          "blue springs only, shift " + std::to_string(shift) + ", " + std::to_string(steps) + " steps", options);
      RecordProperty("blue_shift_" + std::to_string(shift) + "_steps_" + std::to_string(steps),
                     std::to_string(strain[2]));
      EXPECT_LT(strain[2], 1e-3);  // Goldenthal et al. 2007
    }
  }
}

TEST_F(Inextensibility, ShellOfFourContradictingColours) {
  const auto strain = strains_when_hung("all colours, 7 steps", hanging_options());
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    RecordProperty(colour_names[index], std::to_string(strain[index]));
    EXPECT_LT(strain[index], colour == Colour::red ? 0.15 : 0.05) << colour_names[index];
  }
}

}  // namespace
}  // namespace pellicle::inextensibility_test
