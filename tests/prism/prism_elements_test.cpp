#include "prism/prism_elements.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "tests/prism/balloons.h"

namespace pellicle {
namespace {

class PrismElementsOf : public ::testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(all, PrismElementsOf, ::testing::Values("fixed", "incompressible", "plane_stress"),
                         [](const auto& info) { return info.param; });

void expect_force_of_the_energy(const Balloon& balloon) {
  for (const int seed : {2, 3}) {
    const Field w = balloon.random_field(1, seed);
    const PetscInt owned = balloon.membrane.particles.owned;
    const double work = balloon.summed(balloon.force(balloon.x).cwiseProduct(w.values().leftCols(owned)).sum());
    const double step = 1e-7;
    const double slope =
        (balloon.energy(balloon.moved(w, step)) - balloon.energy(balloon.moved(w, -step))) / (2 * step);
    EXPECT_NEAR(slope, -work, 1e-6 * std::abs(work));
  }
}

TEST_P(PrismElementsOf, ForceIsMinusTheGradientOfTheEnergy) {
  Balloon balloon(PETSC_COMM_WORLD, 2, wall_options(GetParam(), 6e5));
  balloon.deform({1.3, 1.1, 0.9}, 0.02);
  expect_force_of_the_energy(balloon);
}

// Where elements have burnt, too, and wherever the vertices of those that are gone are.
TEST_P(PrismElementsOf, BurntElementsHaveTheForceOfTheirEnergy) {
  Balloon balloon(PETSC_COMM_WORLD, 2, wall_options(GetParam(), 6e5));
  balloon.deform({1.3, 1.1, 0.9}, 0.02);
  const double whole = balloon.energy(balloon.x);
  balloon.burn();
  EXPECT_NE(balloon.energy(balloon.x), whole);
  expect_force_of_the_energy(balloon);
  balloon.elements.set_burnt({}, {});
  EXPECT_NEAR(balloon.energy(balloon.x), whole, 1e-12 * whole);
}

// Half the stiffness is half the energy; without any an element may collapse.
TEST_P(PrismElementsOf, StiffnessIsAFactorOnTheEnergy) {
  Balloon balloon(PETSC_COMM_WORLD, 1, wall_options(GetParam(), 6e5));
  balloon.deform({1.3, 1.1, 0.9}, 0.02);
  const double whole = balloon.energy(balloon.x);
  const std::vector<double> one(balloon.membrane.triangles.size(), 1.0);
  balloon.elements.set_burnt(std::vector<double>(one.size(), 0.5), one);
  EXPECT_NEAR(balloon.energy(balloon.x), 0.5 * whole, 1e-14 * whole);
  balloon.elements.set_burnt(std::vector<double>(one.size(), 0.0), one);
  balloon.x.values().setZero();
  EXPECT_EQ(balloon.energy(balloon.x), 0);
  EXPECT_EQ(largest(balloon.force(balloon.x)), 0);
  EXPECT_EQ(balloon.elements.inverted(balloon.x, balloon.x), 0);
}

TEST_P(PrismElementsOf, RigidMotionCostsNothing) {
  Balloon balloon(PETSC_COMM_WORLD, 2, wall_options(GetParam()));
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  balloon.x.values() = (turn * balloon.membrane.rest).colwise() + Eigen::Vector3d(3, -1, 2);
  const double scale = 4e5 * 0.3e-3 * Balloon::radius;  // mu h R [N]
  EXPECT_NEAR(balloon.energy(balloon.x), 0, 1e-10 * scale * Balloon::radius);
  EXPECT_LE(largest(balloon.force(balloon.x)), 1e-10 * scale);
}

TEST_P(PrismElementsOf, CollapsedElementsCostInfinitelyMuch) {
  Balloon balloon(PETSC_COMM_WORLD, 1, wall_options(GetParam()));
  EXPECT_TRUE(std::isfinite(balloon.energy(balloon.x)));
  for (PetscInt i = 0; i < balloon.membrane.particles.local(); ++i) {
    if (balloon.membrane.persistent_id[i] < 20) {  // two of which have an edge in common
      balloon.x.vector(i).setZero();
    }
  }
  EXPECT_EQ(balloon.energy(balloon.x), std::numeric_limits<double>::infinity());
}

TEST_P(PrismElementsOf, EveryNumberOfRanksGivesTheSame) {
  Balloon balloon(PETSC_COMM_WORLD, 2, wall_options(GetParam(), 6e5));
  Balloon whole(PETSC_COMM_SELF, 2, wall_options(GetParam(), 6e5));
  balloon.deform({1.3, 1.1, 0.9}, 0.02);
  whole.deform({1.3, 1.1, 0.9}, 0.02);
  const double energy = whole.energy(whole.x);
  EXPECT_NEAR(balloon.energy(balloon.x), energy, 1e-13 * energy);
  const Eigen::Matrix3Xd force = whole.by_id(whole.force(whole.x));
  EXPECT_LE(largest(balloon.by_id(balloon.force(balloon.x)) - force), 1e-12 * largest(force));
  EXPECT_NEAR(balloon.summed(balloon.elements.volume(balloon.x, balloon.thickness_ratio)),
              whole.elements.volume(whole.x, whole.thickness_ratio), 1e-12 * 4 * M_PI * 0.01 * 0.3e-3);
}

TEST(PrismElements, IncompressibleElementsKeepTheirVolume) {
  Balloon balloon(PETSC_COMM_WORLD, 2, wall_options("incompressible"));
  const double volume = balloon.summed(balloon.elements.volume(balloon.x, balloon.thickness_ratio));
  const double area = volume / 0.3e-3;
  EXPECT_NEAR(area, 4 * M_PI * 0.01, 0.04 * area);  // an icosphere of 320 triangles is that much smaller
  const double stretch = 1.7;
  balloon.deform(Eigen::Vector3d::Constant(stretch), 0);
  for (const double ratio : balloon.thickness_ratio) {
    EXPECT_NEAR(ratio, 1 / (stretch * stretch), 1e-13);
  }
  EXPECT_NEAR(balloon.summed(balloon.elements.volume(balloon.x, balloon.thickness_ratio)), volume, 1e-12 * volume);
}

TEST(PrismElements, FixedThicknessIsLeftAlone) {
  Balloon balloon(PETSC_COMM_WORLD, 1, wall_options("fixed"));
  balloon.thickness_ratio.assign(balloon.thickness_ratio.size(), 0.25);
  balloon.elements.update_thickness(balloon.x, balloon.thickness_ratio);
  for (const double ratio : balloon.thickness_ratio) {
    EXPECT_EQ(ratio, 0.25);
  }
}

TEST(PrismElements, InvertedElementsAreCountedOnce) {
  Balloon balloon(PETSC_COMM_WORLD, 1, wall_options("incompressible"));
  Field to(balloon.membrane.particles, 3);
  const auto inverted = [&] {
    return std::lround(balloon.summed(static_cast<double>(balloon.elements.inverted(balloon.x, to))));
  };
  to.values() = 1e-5 * balloon.x.values();
  EXPECT_EQ(inverted(), 0);
  to.values() = 1e-7 * balloon.x.values();  // 1e-14 of the area
  EXPECT_EQ(inverted(), 80);
  to.values().setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(inverted(), 80);
  to.values() = balloon.x.values();
  for (PetscInt i = 0; i < balloon.membrane.particles.local(); ++i) {
    if (balloon.membrane.persistent_id[i] == 0) {  // a corner of the icosahedron: 5 triangles
      to.vector(i) *= -1;  // Each triangle turns about the opposite edge by more than 90 degrees.
    }
  }
  EXPECT_EQ(inverted(), 5);
}

}  // namespace
}  // namespace pellicle
