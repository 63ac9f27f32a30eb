#include "elastic/sheet_springs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

/// A sheet of 8 x 6 cells of 0.1 by 0.1 / aspect, sheared by `skew`.
Sheet sheet_of(double aspect, double skew) {
  SurfaceMesh mesh = grid_mesh(8, 6, 0.1);
  for (Eigen::Vector3d& point : mesh.points) {
    point = {point.x() + skew * point.y(), point.y() / aspect, 0};
  }
  SheetOptions options;
  options.is_one_surface = true;
  return make_sheet(PETSC_COMM_WORLD, mesh, options);
}

/// Energy of all springs per area under an even strain (e11, e22, e12), to second order.
double energy_per_area(const Sheet& sheet, const std::array<std::vector<double>, 4>& stiffness,
                       const Eigen::Matrix2d& strain, double area) {
  double energy = 0;
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet.of(colour);
    for (PetscInt s = 0; s < set.owned(); ++s) {
      const auto [a, b] = set.ends[s];
      const Eigen::Vector2d arm = (sheet.rest.col(a) - sheet.rest.col(b)).head<2>();
      const double stretch = arm.dot(strain * arm) / arm.norm();
      energy += stiffness[static_cast<std::size_t>(colour)][s] / 2 * stretch * stretch;
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &energy, 1, MPI_DOUBLE, MPI_SUM, sheet.comm());
  return energy / area;
}

Eigen::Matrix2d strain_of(double e11, double e22, double e12) {
  return (Eigen::Matrix2d() << e11, e12, e12, e22).finished();
}

TEST(SheetSpringsTest, AnEvenStrainHasTheEnergyOfTheMaterial) {
  Stiffness stiffness;
  stiffness.tensile = {900, 700};
  stiffness.shear = 250;
  for (const double aspect : {1.0, 1.4}) {
    const Sheet sheet = sheet_of(aspect, 0);
    const std::array<std::vector<double>, 4> springs =
        SheetSprings(sheet, stiffness, Eigen::Vector3d::UnitX(), MaterialFactors()).stiffness(ActiveSet(sheet));
    const double area = 0.8 * 0.6 / aspect;
    const auto energy = [&](const Eigen::Matrix2d& strain) { return energy_per_area(sheet, springs, strain, area); };
    const double c11 = 2 * energy(strain_of(1, 0, 0));
    const double c22 = 2 * energy(strain_of(0, 1, 0));
    const double c12 = energy(strain_of(1, 1, 0)) - (c11 + c22) / 2;
    const double c66 = energy(strain_of(0, 0, 1)) / 2;
    EXPECT_NEAR(c11 - c12 * c12 / c22, stiffness.tensile[0], 1e-9 * stiffness.tensile[0]) << aspect;
    EXPECT_NEAR(c22 - c12 * c12 / c11, stiffness.tensile[1], 1e-9 * stiffness.tensile[1]) << aspect;
    EXPECT_NEAR(c66, stiffness.shear, 1e-9 * stiffness.shear) << aspect;
    EXPECT_NEAR(c12, stiffness.shear, 1e-9 * stiffness.shear) << "Cauchy's relation, " << aspect;
    EXPECT_NEAR(energy(strain_of(1, 0, 1)), c11 / 2 + 2 * c66, 1e-9 * c11) << "no coupling with shear";
  }
}

TEST(SheetSpringsTest, TexturesAndDirectionsChangeWhatTheyShould) {
  Stiffness stiffness;
  stiffness.tensile = {1000, 10};
  stiffness.shear = 1;
  const Sheet sheet = sheet_of(1, 0);
  const std::array<std::vector<double>, 4> along_y =
      SheetSprings(sheet, stiffness, Eigen::Vector3d::UnitY(), MaterialFactors()).stiffness(ActiveSet(sheet));
  const std::vector<double> half(sheet.particles.local(), 0.5);
  const std::array<std::vector<double>, 4> softer =
      SheetSprings(sheet, stiffness, Eigen::Vector3d::UnitY(), MaterialFactors{half, half, {}})
          .stiffness(ActiveSet(sheet));
  const SpringSet& green = sheet.of(Colour::green);
  for (PetscInt s = 0; s < green.owned(); ++s) {
    const auto [a, b] = green.ends[s];
    const bool is_warp = std::abs((sheet.rest.col(a) - sheet.rest.col(b)).y()) > 0.05;
    const double k = along_y[static_cast<std::size_t>(Colour::green)][s];
    EXPECT_NEAR(k, is_warp ? 500 : 4.5, is_warp ? 1 : 0.1);
    EXPECT_NEAR(softer[static_cast<std::size_t>(Colour::green)][s], k / 2, 1e-12 * k);
  }
}

TEST(SheetSpringsTest, DeadSpringsHaveNoneThoughATriangleLives) {
  const Sheet sheet = sheet_of(1, 0);
  Stiffness stiffness;
  stiffness.tensile = {900, 700};
  stiffness.shear = 250;
  ActiveSet active(sheet);
  // Of each cell one triangle is left, so that some springs hold corners without a surface.
  for (std::size_t t = 0; t < active.triangles.size(); ++t) {
    active.triangles[t] = t % 4 == 0;
  }
  const auto stiff = [&](Colour colour) {
    const std::vector<double> springs = SheetSprings(sheet, stiffness, Eigen::Vector3d::UnitX(), MaterialFactors())
                                            .stiffness(active)[static_cast<std::size_t>(colour)];
    const auto owned = static_cast<std::size_t>(sheet.of(colour).owned());
    return std::count_if(springs.begin(), springs.begin() + static_cast<std::ptrdiff_t>(owned),
                         [](double k) { return k > 0; });
  };
  for (const Colour colour : all_colours) {
    EXPECT_TRUE(sheet.of(colour).owned() == 0 || stiff(colour) > 0) << static_cast<int>(colour);
    std::vector<bool>& springs = active.springs[static_cast<std::size_t>(colour)];
    springs.assign(springs.size(), false);
    EXPECT_EQ(stiff(colour), 0) << static_cast<int>(colour);
  }
}

TEST(SheetSpringsTest, AWarpThatStandsUprightIsLaidDown) {
  const Sheet sheet = sheet_of(1, 0);
  const Eigen::Matrix3Xd warp = warp_of(sheet, Eigen::Vector3d::UnitZ());
  for (Eigen::Index i = 0; i < sheet.particles.owned; ++i) {
    EXPECT_NEAR(warp.col(i).norm(), 1, 1e-14);
    EXPECT_NEAR(warp(2, i), 0, 1e-14);
  }
}

}  // namespace
}  // namespace pellicle
