// Of which springs the mean strain of history.csv is.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/alone.h"
#include "tests/support/grid_mesh.h"

namespace pellicle::mean_strain_test {
namespace {

/// A flat sheet of 5 x 3 cells, 0.1 m x 0.1/aspect m, laid on the surface z = 4 x y / m.
struct TwistedSheet : Alone {
  explicit TwistedSheet(Choice<Dynamics> dynamics, double aspect = 1) : Alone(mesh(aspect), options_of(dynamics)) {
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

  static SurfaceMesh mesh(double aspect) {
    SurfaceMesh mesh = grid_mesh(5, 3, 0.1);
    for (Eigen::Vector3d& point : mesh.points) {
      point.y() /= aspect;
    }
    return mesh;
  }

  /// Mean |d/l - 1| of the springs of some kind. @param counts called with colour, number and arm at rest
  template <class Counts>
  double mean_of(const Counts& counts) const {
    std::array<double, 2> sums{};
    for (const Colour colour : all_colours) {
      const SpringSet& set = sheet().of(colour);
      for (PetscInt s = 0; s < set.owned(); ++s) {
        const auto [a, b] = set.ends[s];
        const Eigen::Vector3d arm = sheet().rest.col(a) - sheet().rest.col(b);
        if (counts(colour, s, arm)) {
          sums[0] += std::abs((state().position.vector(a) - state().position.vector(b)).norm() / arm.norm() - 1);
          sums[1] += 1;
        }
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, sheet().comm());
    return sums[0] / sums[1];
  }
};

TEST(MeanStrain, OfAProjectedSheetIsOfAllSprings) {
  const TwistedSheet scene(Dynamics::projection);
  EXPECT_NEAR(scene.figure("mean_strain"),
              scene.mean_of([](Colour, std::size_t, const Eigen::Vector3d&) { return true; }), 1e-14);
}

TEST(MeanStrain, OfAnElasticSheetIsNotOfIdleYellowSprings) {
  const TwistedSheet scene(Dynamics::elastic);
  const double bearing =
      scene.mean_of([](Colour colour, std::size_t, const Eigen::Vector3d&) { return colour != Colour::yellow; });
  const double all = scene.mean_of([](Colour, std::size_t, const Eigen::Vector3d&) { return true; });
  EXPECT_GT(std::abs(bearing - all), 1e-3 * all);
  EXPECT_NEAR(scene.figure("mean_strain"), bearing, 1e-14);
}

TEST(MeanStrain, OfACellThatHasLostAPartIsOfItsYellowSprings) {
  TwistedSheet scene(Dynamics::elastic);
  // The cell of the greatest ids.
  const auto is_broken = [&](PetscInt triangle) {
    PetscInt least = scene.sheet().id_end;
    for (const PetscInt corner : scene.sheet().cells[triangle / 4]) {
      least = std::min(least, scene.sheet().persistent_id[corner]);
    }
    return least == 16;  // 2 rows of 6, and 4
  };
  for (std::size_t t = 0; t < scene.burning().active.triangles.size(); t += 4) {
    scene.burning().active.triangles[t] = !is_broken(static_cast<PetscInt>(t));
  }
  scene.object.keep();
  scene.object.restore();  // Springs follow triangles.
  const double bearing = scene.mean_of([&](Colour colour, std::size_t s, const Eigen::Vector3d&) {
    const PetscInt triangle = scene.sheet().of(colour).triangles[s][0];
    const bool lives = scene.burning().active.springs[static_cast<std::size_t>(colour)][s];
    return lives && (colour != Colour::yellow || is_broken(triangle));
  });
  EXPECT_NEAR(scene.figure("mean_strain"), bearing, 1e-14);
}

TEST(MeanStrain, OfLongCellsIsNotOfTheSpringsAlongThem) {
  // The diagonals alone are stiffer along these cells than the sheet is to be.
  const TwistedSheet scene(Dynamics::elastic, 2);
  const double bearing = scene.mean_of([](Colour colour, std::size_t, const Eigen::Vector3d& arm) {
    return colour == Colour::red || (colour != Colour::yellow && std::abs(arm.x()) < 1e-9);
  });
  EXPECT_NEAR(scene.figure("mean_strain"), bearing, 1e-14);
}

}  // namespace
}  // namespace pellicle::mean_strain_test
