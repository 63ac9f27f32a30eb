#include "surface/weave_strain.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/projection/sheets.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

using Eigen::Vector3d;

/// Five particles in a row, 1 m apart: red, blue, green, blue springs.
Sheet row_of_springs() {
  Eigen::Matrix3Xd rest = Eigen::Matrix3Xd::Zero(3, 5);
  rest.row(0) << 0, 1, 2, 3, 4;
  return hand_made_sheet(rest, {{Colour::red, {{0, 1}}}, {Colour::blue, {{1, 2}, {3, 4}}}, {Colour::green, {{2, 3}}}});
}

WeaveStrain strain_of(const Scene& scene) { return weave_strain(scene.sheet, scene.x, scene.target, scene.active); }

TEST(WeaveStrain, OfAHandMadeRow) {
  Scene scene(row_of_springs());
  scene.x.values().row(0) << 0, 2, 3.1, 3.9, 4.4;  // strains 1, 0.1, -0.2, -0.5
  WeaveStrain strain = strain_of(scene);
  EXPECT_NEAR(strain.largest, 0.5, 1e-14);
  EXPECT_EQ(strain.colour, Colour::blue);
  EXPECT_EQ(strain.ids, (std::array<PetscInt, 2>{3, 4}));
  EXPECT_LE((strain.place - Vector3d(4.15, 0, 0)).norm(), 1e-14);
  EXPECT_NEAR(strain.mean, 1.8 / 4, 1e-14) << "red springs count for the mean";

  scene.active.springs[static_cast<std::size_t>(Colour::blue)][1] = false;
  strain = strain_of(scene);
  EXPECT_NEAR(strain.largest, 0.2, 1e-14);
  EXPECT_EQ(strain.colour, Colour::green);
  EXPECT_EQ(strain.ids, (std::array<PetscInt, 2>{2, 3}));
  EXPECT_NEAR(strain.mean, 1.3 / 3, 1e-14);

  scene.scale_targets(Colour::green, 0.8);
  EXPECT_NEAR(strain_of(scene).largest, 0.1, 1e-14) << "against target lengths";
}

TEST(WeaveStrain, NothingLives) {
  Scene scene(row_of_springs());
  for (auto& springs : scene.active.springs) {
    springs.assign(springs.size(), false);
  }
  const WeaveStrain strain = strain_of(scene);
  EXPECT_EQ(strain.largest, 0);
  EXPECT_EQ(strain.ids[0], -1);
  EXPECT_EQ(strain.mean, 0);
}

TEST(WeaveStrain, OfEqualStrainsTheLeastIdsCount) {
  Scene scene(row_of_springs());
  EXPECT_EQ(strain_of(scene).ids, (std::array<PetscInt, 2>{1, 2}));
}

/// A grid whose particle of an id is pulled out of its place. Its strains are the same on any number of ranks.
struct PulledGrid : Scene {
  explicit PulledGrid(double displacement) : Scene(make_sheet(PETSC_COMM_WORLD, grid_mesh(6, 4, 0.1), options())) {
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      if (sheet.persistent_id[i] == 17) {  // at (0.3, 0.2)
        x.vector(i) += Vector3d(displacement, 0, 0);
      }
    }
  }
  static SheetOptions options() {
    SheetOptions options;
    options.thickness = 0.025;
    return options;
  }
};

TEST(WeaveStrain, ValueAndPlaceAreTheSameOnEveryRank) {
  const PulledGrid scene(0.03);
  const WeaveStrain strain = strain_of(scene);
  EXPECT_NEAR(strain.largest, 0.3, 1e-12);
  EXPECT_EQ(strain.colour, Colour::blue);
  // The one before it and the one after: rounding decides, for all ranks.
  const bool is_before = strain.ids == std::array<PetscInt, 2>{16, 17};
  EXPECT_TRUE(is_before || strain.ids == (std::array<PetscInt, 2>{17, 18}));
  EXPECT_LE((strain.place - Vector3d(is_before ? 0.265 : 0.365, 0.2, 0)).norm(), 1e-12);
}

TEST(StrainLimit, IsMet) {
  for (const double displacement : {0.03, -0.06}) {
    PulledGrid scene(displacement);
    ProjectOptions options;
    options.max_steps = 1;
    options.weight.fill(0);  // that the limit alone acts
    options.strain_limit = 0.02;
    SuccessiveProjection projection(scene.sheet, options);
    const StageResult result = projection.advance(scene.x, scene.input());
    EXPECT_TRUE(result.converged) << result.reason;
    EXPECT_GT(result.iterations, 0);
    const WeaveStrain strain = strain_of(scene);
    EXPECT_LE(strain.largest, 0.02);
    EXPECT_GT(strain.largest, 0.01) << "no more than need be";
    EXPECT_NEAR(result.error, projection.errors(scene.x, scene.input()).total, 1e-15);
  }
}

TEST(StrainLimit, WhatIsWithinItStaysWhereItIs) {
  PulledGrid scene(0.03);
  const Eigen::MatrixXd before = scene.x.values();
  ProjectOptions options;
  options.max_steps = 1;
  options.weight.fill(0);
  options.strain_limit = 0.31;
  SuccessiveProjection projection(scene.sheet, options);
  EXPECT_TRUE(projection.advance(scene.x, scene.input()).converged);
  EXPECT_EQ(before, scene.x.values());
}

TEST(StrainLimit, WithoutOneNothingChanges) {
  PulledGrid with(0.03);
  PulledGrid without(0.03);
  ProjectOptions options;
  SuccessiveProjection(without.sheet, options).advance(without.x, without.input());
  options.strain_limit = 100;
  SuccessiveProjection(with.sheet, options).advance(with.x, with.input());
  EXPECT_EQ(with.x.values(), without.x.values());
}

TEST(StrainLimit, FailureNamesSpringPlaceAndValue) {
  PulledGrid scene(0.03);
  for (std::size_t i = 0; i < scene.pinned.size(); ++i) {
    const PetscInt id = scene.sheet.persistent_id[i];
    scene.pinned[i] = id >= 16 && id <= 18;
  }
  ProjectOptions options;
  options.strain_limit = 0.1;
  options.strain_steps = 3;
  SuccessiveProjection projection(scene.sheet, options);
  const StageResult result = projection.advance(scene.x, scene.input());
  EXPECT_FALSE(result.converged);
  for (const char* words : {"the blue spring of particles 1", " is strained by 30 % at (0.", ", 0.2, 0) m",
                            "above project.strain_limit 0.1, after 3 steps"}) {
    EXPECT_NE(result.reason.find(words), std::string::npos) << words << " is not in: " << result.reason;
  }
}

}  // namespace
}  // namespace pellicle
