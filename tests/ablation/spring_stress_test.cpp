#include "ablation/spring_stress.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "ablation/cracks.h"
#include "tests/ablation/sheets.h"

namespace pellicle {
namespace {

constexpr double min_mass = 0.4;
constexpr double edge = 0.5;  // [m]
constexpr int cells = 6;
constexpr double particle_mass = 0.2;  // [kg]

/// A square sheet in the plane with all that tearing reads: unburnt and free until a test changes it.
struct TearScene {
  explicit TearScene(MPI_Comm comm = PETSC_COMM_WORLD)
      : sheet(shell_of(grid_mesh(cells, cells, edge), comm)),
        active(sheet),
        position(sheet.particles, 3),
        mass(sheet.particles, 1) {
    sheet.initial_mass.assign(sheet.initial_mass.size(), particle_mass);
    mass.values().setConstant(particle_mass);
    position.values() = sheet.rest;
    pinned.assign(sheet.initial_mass.size(), false);
    for (std::size_t colour = 0; colour < 4; ++colour) {
      force[colour].assign(static_cast<std::size_t>(sheet.springs[colour].owned()), 0);
    }
  }
  TearScene(const TearScene&) = delete;
  TearScene& operator=(const TearScene&) = delete;

  /// Tension in the owned springs of a colour.
  /// @param force_of [N] of a spring that leads along a vector [m] and begins at a point
  template <class Force>
  void load(Colour colour, const Force& force_of) {
    const SpringSet& set = sheet.of(colour);
    for (PetscInt s = 0; s < set.owned(); ++s) {
      const Eigen::Vector3d from = sheet.rest.col(set.ends[s][0]);
      const Eigen::Vector3d along = sheet.rest.col(set.ends[s][1]) - from;
      force[static_cast<std::size_t>(colour)][s] = force_of(from, along);
    }
  }

  /// A uniform stress along x [N/m]: blue springs along x carry a width of one edge each, half of it at the rim.
  void pull_along_x(double stress) {
    load(Colour::blue, [&](const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
      const bool is_rim = from.y() < edge / 4 || from.y() > (cells - 0.25) * edge;
      return std::abs(along.x()) > edge / 2 ? stress * edge * (is_rim ? 0.5 : 1) : 0;
    });
  }

  Sheet sheet;
  ActiveSet active;
  std::array<std::vector<double>, 4> force;
  Field position;
  Field mass;
  std::vector<bool> pinned;
};

/// The cracks of a sheet by the stress of its springs.
class Tearing {
 public:
  Tearing(const Sheet& sheet, const AblationOptions& options, const std::vector<double>& texture)
      : stress_(sheet), cracks_(sheet, options, texture) {}

  std::vector<PetscInt> cracks(const TearScene& scene) {
    const auto& stress = stress_.find(scene.active, scene.force, scene.position);
    return cracks_.sides({scene.active, stress, scene.position, scene.mass, scene.pinned, min_mass});
  }

 private:
  SpringStress stress_;
  Cracks cracks_;
};

AblationOptions strength_100() {
  AblationOptions options;
  options.strength = 100;
  options.strength_length = 0;
  return options;
}

/// The pairs of ids of the ends of sides that crack, of all ranks. Collective.
std::vector<PetscInt> cracked_ids(const TearScene& scene, const std::vector<PetscInt>& sides) {
  std::vector<PetscInt> codes;
  for (const PetscInt side : sides) {
    const auto [a, b] = ids_of(scene.sheet, Colour::blue, side);
    codes.push_back(1000 * a + b);
  }
  return gathered(scene.sheet.comm(), codes);
}

/// The uniform stress along x above which the first side cracks [N/m]. Collective.
double threshold(TearScene& scene, const std::vector<double>& texture = {}) {
  Tearing tearing(scene.sheet, strength_100(), texture);
  double below = 0;
  double above = 1000;
  for (int k = 0; k < 35; ++k) {
    const double middle = (below + above) / 2;
    scene.pull_along_x(middle);
    auto count = static_cast<int>(tearing.cracks(scene).size());
    MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT, MPI_SUM, scene.sheet.comm());
    (count == 0 ? below : above) = middle;
  }
  return above;
}

TEST(Tearing, UniformStressTearsAtTheStrength) {
  TearScene scene;
  EXPECT_NEAR(threshold(scene), 100, 1e-6);
  // The frame of reference does not matter.
  const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, 2, -1).normalized());
  scene.position.values() = turn.toRotationMatrix() * scene.sheet.rest;
  EXPECT_NEAR(threshold(scene), 100, 1e-6);
}

TEST(Tearing, SidesAcrossTheStressCrack) {
  TearScene scene;
  Tearing tearing(scene.sheet, strength_100(), {});
  scene.pull_along_x(101);
  // All of them, as no one exceeds its strength by more than the others; a side at the rim has no second cell.
  std::vector<PetscInt> expected;
  for (int j = 0; j < cells; ++j) {
    for (int i = 1; i < cells; ++i) {
      const int vertex = j * (cells + 1) + i;
      expected.push_back(1000 * vertex + vertex + cells + 1);
    }
  }
  EXPECT_EQ(cracked_ids(scene, tearing.cracks(scene)), expected);
}

/// A texture that is strong near the corner points of the sheet, which have one diagonal only.
std::vector<double> strong_corners(const TearScene& scene) {
  std::vector<double> texture;
  for (Eigen::Index i = 0; i < scene.sheet.rest.cols(); ++i) {
    const Eigen::Array2d from_middle = (scene.sheet.rest.col(i).head<2>().array() / edge - cells / 2.0).abs();
    texture.push_back(from_middle.minCoeff() > cells / 2.0 - 1.1 ? 1e9 : 1);
  }
  return texture;
}

/// The largest principal stress above which the first side cracks when the sheet is pulled at an angle to its sides
/// [N/m].
double threshold_at(double angle) {
  TearScene scene;
  Tearing tearing(scene.sheet, strength_100(), strong_corners(scene));
  double below = 0;
  double above = 1000;
  for (int k = 0; k < 35; ++k) {
    const double middle = (below + above) / 2;
    // sigma = s d d^T: the rising diagonal of a cell has F L/(2 A) of each part, blue springs the rest of xx and yy.
    const Eigen::Vector2d d(std::cos(angle), std::sin(angle));
    const double xy = middle * d.x() * d.y();
    scene.load(Colour::yellow, [&](const Eigen::Vector3d&, const Eigen::Vector3d& along) {
      return along.x() * along.y() > 0 ? 2 * xy * edge * edge / along.norm() : 0;
    });
    scene.load(Colour::blue, [&](const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
      const Eigen::Vector3d at = from + along / 2;
      const double rim = std::min({at.x(), at.y(), cells * edge - at.x(), cells * edge - at.y()});
      const double part = (std::abs(along.x()) > edge / 2 ? d.x() * d.x() : d.y() * d.y()) * middle - xy;
      return part * edge * (rim < edge / 4 ? 0.5 : 1);
    });
    auto count = static_cast<int>(tearing.cracks(scene).size());
    MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
    (count == 0 ? below : above) = middle;
  }
  return above;
}

TEST(Tearing, TheDirectionsOfTheSidesDoNotMatter) {
  for (const double degrees : {0.0, 10.0, 30.0, 45.0, 60.0, 90.0}) {
    EXPECT_NEAR(threshold_at(degrees * std::acos(-1) / 180), 100, 1e-6) << degrees;
  }
}

TEST(Tearing, SpringsThatPullAgainstEachOtherDoNotTear) {
  // Two diagonals, each of sqrt(2) edges at 45 degrees, push as much as the edges round a cell pull.
  TearScene scene;
  const std::vector<double> texture = strong_corners(scene);
  Tearing tearing(scene.sheet, strength_100(), texture);
  const double force = 1e5;
  scene.load(Colour::blue, [&](const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
    const Eigen::Vector3d middle = from + along / 2;
    const double rim = std::min({middle.x(), middle.y(), cells * edge - middle.x(), cells * edge - middle.y()});
    return rim < edge / 4 ? force / 2 : force;
  });
  scene.load(Colour::yellow, [&](const Eigen::Vector3d&, const Eigen::Vector3d&) { return -force / std::sqrt(2.0); });
  EXPECT_TRUE(tearing.cracks(scene).empty());
}

TEST(Tearing, PushedSheetsDoNotTear) {
  TearScene scene;
  Tearing tearing(scene.sheet, strength_100(), {});
  scene.pull_along_x(-1000);
  EXPECT_TRUE(tearing.cracks(scene).empty());
}

TEST(Tearing, WhatIsPinnedAtBothEndsDoesNotCrack) {
  // All corners of every second column.
  TearScene scene;
  for (std::size_t i = 0; i < scene.pinned.size(); ++i) {
    const double column = scene.sheet.rest(0, static_cast<Eigen::Index>(i)) / edge;
    scene.pinned[i] = std::abs(std::remainder(column, 2)) < 0.1;
  }
  EXPECT_NEAR(threshold(scene), 100, 1e-6);
  scene.pinned.assign(scene.pinned.size(), true);
  EXPECT_EQ(threshold(scene), 1000) << "nothing moves either end";
}

TEST(Tearing, WhatHasCrackedDoesNotCrackAgain) {
  TearScene scene;
  scene.active.cracked.assign(scene.active.cracked.size(), true);
  EXPECT_EQ(threshold(scene), 1000);
}

TEST(Tearing, WhatHasBurntDoesNotCrack) {
  TearScene scene;
  scene.active.triangles.assign(scene.active.triangles.size(), false);
  for (auto& springs : scene.active.springs) {
    springs.assign(springs.size(), false);
  }
  EXPECT_EQ(threshold(scene), 1000);
}

TEST(Tearing, CharAndTextureWeaken) {
  TearScene scene;
  // A tenth of the strength is left at the least mass, 0.55 at half of the way.
  for (const auto& [left, fraction] :
       {std::pair{(1 + min_mass) / 2, 0.55}, {min_mass, 0.1}, {min_mass / 2, 0.1}, {1.0, 1.0}}) {
    scene.mass.values().setConstant(particle_mass * left);
    EXPECT_NEAR(threshold(scene), 100 * fraction, 1e-6);
  }
  // 0.5 at one particle and 2 everywhere else: the sides along y that end there have 1.25.
  std::vector<double> texture = level_by_id(scene.sheet, [](PetscInt id) { return id == 24 ? 0.5 : 2; });
  EXPECT_NEAR(threshold(scene, texture), 125, 1e-6);
  Tearing tearing(scene.sheet, strength_100(), texture);
  scene.pull_along_x(150);
  EXPECT_EQ(cracked_ids(scene, tearing.cracks(scene)), (std::vector<PetscInt>{17024, 24031}))
      << "both are worse off than all sides that they meet, which do not exceed their strength";
}

TEST(Tearing, OfTheSidesThatMeetOnlyTheMostOverloadedCracks) {
  TearScene scene;
  AblationOptions options = strength_100();
  options.strength_scatter = 0.5;
  options.scatter_length = edge;
  Tearing tearing(scene.sheet, options, {});
  scene.pull_along_x(400);  // beyond the strength of each
  const std::vector<PetscInt> cracked = cracked_ids(scene, tearing.cracks(scene));
  std::vector<PetscInt> ends;
  for (const PetscInt code : cracked) {
    ends.push_back(code / 1000);
    ends.push_back(code % 1000);
  }
  EXPECT_GE(ends.size(), 4U);
  std::sort(ends.begin(), ends.end());
  EXPECT_EQ(std::adjacent_find(ends.begin(), ends.end()), ends.end()) << "none share a corner";

  TearScene alone(PETSC_COMM_SELF);
  Tearing tearing_alone(alone.sheet, options, {});
  alone.pull_along_x(400);
  EXPECT_EQ(cracked, cracked_ids(alone, tearing_alone.cracks(alone))) << "the same on any ranks";
}

}  // namespace
}  // namespace pellicle
