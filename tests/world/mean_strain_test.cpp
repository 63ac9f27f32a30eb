// Of which springs the mean strain of history.csv is.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/alone.h"
#include "tests/support/grid_mesh.h"

namespace pellicle::mean_strain_test {
namespace {

/// A flat sheet of 5 x 3 cells, 0.1 m x 0.1 m, laid on the surface z = 4 x y / m.
struct TwistedSheet : Alone {
  explicit TwistedSheet(Choice<Dynamics> dynamics) : Alone(grid_mesh(5, 3, 0.1), options_of(dynamics)) {
    for (PetscInt i = 0; i < surface().particles.local(); ++i) {
      auto x = state().position.vector(i);
      x.z() += 4 * x.x() * x.y();
    }
  }

  static Options options_of(Choice<Dynamics> dynamics) {
    Options options;
    options.dynamics = dynamics;
    return options;
  }

  /// Mean |d/l - 1| of the springs of some kind. @param counts called with colour and number
  template <class Counts>
  double mean_of(const Counts& counts) const {
    std::array<double, 2> sums{};
    for (const Colour colour : all_colours) {
      const SpringSet& set = sheet().of(colour);
      for (PetscInt s = 0; s < set.owned(); ++s) {
        const auto [a, b] = set.ends[s];
        const Eigen::Vector3d arm = sheet().rest.col(a) - sheet().rest.col(b);
        if (counts(colour, s)) {
          sums[0] += std::abs((state().position.vector(a) - state().position.vector(b)).norm() / arm.norm() - 1);
          sums[1] += 1;
        }
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, sheet().comm());
    return sums[0] / sums[1];
  }
};

TEST(MeanStrain, IsOfAllSpringsThatLiveAndAct) {
  for (const Dynamics dynamics : {Dynamics::projection, Dynamics::elastic}) {
    TwistedSheet scene(dynamics);
    const auto acts = [dynamics](Colour colour) {
      return dynamics == Dynamics::projection || colour == Colour::blue || colour == Colour::red;
    };
    EXPECT_NEAR(scene.figure("mean_strain"), scene.mean_of([&](Colour colour, std::size_t) { return acts(colour); }),
                1e-14);
    // Of the cell of the greatest ids a triangle goes.
    for (std::size_t t = 0; t < scene.burning().active.triangles.size(); t += 4) {
      PetscInt least = scene.sheet().id_end;
      for (const PetscInt corner : scene.sheet().cells[t / 4]) {
        least = std::min(least, scene.sheet().persistent_id[corner]);
      }
      scene.burning().active.triangles[t] = least != 16;  // 2 rows of 6, and 4
    }
    scene.object.keep();
    scene.object.restore();  // Springs follow triangles.
    const auto lives = [&](Colour colour, std::size_t s) {
      return acts(colour) && scene.burning().active.springs[colour][s];
    };
    EXPECT_NEAR(scene.figure("mean_strain"), scene.mean_of(lives), 1e-14);
  }
}

}  // namespace
}  // namespace pellicle::mean_strain_test
