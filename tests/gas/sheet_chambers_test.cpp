// Gas within a sheet of quads: its volume, its forces, and what a step makes of its pressure.

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "gas/flowing_gas.h"
#include "geometry/pi.h"
#include "meshing/closed_shapes.h"
#include "meshing/generators.h"
#include "parallel/collective.h"
#include "surface/shell.h"
#include "tests/gas/membranes.h"

namespace pellicle {
namespace {

const Eigen::Vector3d axes(0.1, 0.2, 0.3);

Sheet closed_sheet(int level, double thickness) {
  SheetOptions options;
  options.thickness = thickness;
  return make_sheet(PETSC_COMM_WORLD, quad_ellipsoid_mesh(level, axes), options);
}

ChamberOptions of_pressure(double pressure) {
  ChamberOptions options;
  options.law = "pressure";
  options.pressure = {{0, pressure}};
  return options;
}

ChamberOptions air(double amount_ratio) {
  ChamberOptions options;
  options.law = "isothermal";
  options.amount_ratio = {{0, amount_ratio}};
  return options;
}

Field place_of(const Sheet& sheet) {
  Field x(sheet.particles, 3);
  x.values() = sheet.rest;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {  // crumpled, by the ids alone
    const auto id = static_cast<double>(sheet.persistent_id[i]);
    x.vector(i) += 0.01 * Eigen::Vector3d(std::sin(12.9 * id), std::sin(78.2 * id), std::sin(37.7 * id));
  }
  return x;
}

TEST(SheetChambers, TheVolumeIsThatBetweenCornersAndLatticePoints) {
  // At no thickness a lattice point lies in the middle of its corners: second order in the length of the sides.
  const double exact = 4 * pi / 3 * axes.prod();
  double coarse = 0;
  for (int level = 2; level <= 4; ++level) {
    const Sheet sheet = closed_sheet(level, 1e-12);
    const Chambers chambers(sheet, GasOptions(), {{"air", of_pressure(1)}});
    ASSERT_EQ(chambers.count(), 1);
    const double error = 1 - chambers.initial_volume(0) / exact;
    if (level > 2) {
      EXPECT_NEAR(coarse / error, 4, 0.3) << level;
    }
    coarse = error;
  }
  // A lattice point at a distance t off its quad adds a pyramid, A t / 3.
  const double t = 1e-3;
  const Sheet sheet = closed_sheet(3, t);
  double area = 0;
  for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
    area += sheet.element_mass[cell] / SheetOptions().areal_density;
  }
  const double added = Chambers(sheet, GasOptions(), {{"air", of_pressure(1)}}).initial_volume(0) -
                       Chambers(closed_sheet(3, 1e-12), GasOptions(), {{"air", of_pressure(1)}}).initial_volume(0);
  EXPECT_NEAR(added, sum_over_ranks(PETSC_COMM_WORLD, area) * t / 3, 1e-6 * added);
}

TEST(SheetChambers, ForcesAreTheVolumesDerivativeAndAddUpToNothing) {
  const Sheet sheet = closed_sheet(3, 5e-3);
  const Chambers chambers(sheet, GasOptions(), {{"air", of_pressure(1)}});
  Field x = place_of(sheet);
  const Eigen::Matrix3Xd gradient = chambers.volume_gradient(0, x);
  const double largest = gradient.size() > 0 ? gradient.cwiseAbs().maxCoeff() : 0;
  EXPECT_LE(sum_over_world(Eigen::Vector3d(gradient.rowwise().sum())).norm(), 1e-12 * axes.prod() / axes[0]);
  EXPECT_LT(largest, 1);
  Field w(sheet.particles, 3);
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const auto id = static_cast<double>(sheet.persistent_id[i]);
    w.vector(i) = Eigen::Vector3d(std::sin(3.1 * id), std::cos(5.7 * id), std::sin(7.3 * id + 1));
  }
  const auto volume_at = [&](double step) {
    Field moved(sheet.particles, 3);
    moved.values() = x.values() + step * w.values();
    return chambers.volumes(moved)[0];
  };
  const double step = 1e-4;
  const double slope =
      (8 * (volume_at(step) - volume_at(-step)) - volume_at(2 * step) + volume_at(-2 * step)) / (12 * step);
  const double expected =
      sum_over_ranks(PETSC_COMM_WORLD, gradient.cwiseProduct(w.values().leftCols(gradient.cols())).sum());
  EXPECT_NEAR(slope, expected, 1e-8 * std::abs(expected) + 1e-12);
}

Eigen::VectorXd one(double value) { return Eigen::VectorXd::Constant(1, value); }

/// The gas of the only chamber after a step in which its pressure moves its wall, see FlowingGas.
GasState moved_state(const Chambers& chambers, double volume, double compliance) {
  const GasStep step{&chambers.initial_exchange()};
  const FlowingGas::Walls walls =
      FlowingGas({{"", &chambers, &step}}).moved_walls(FlowingGas::Walls(1), {{one(volume), one(compliance)}}, 0);
  GasState gas = chambers.state(0, walls[0][0], 0);
  if (chambers.prescribes_volume(0)) {
    gas.pressure = (walls[0][0] - volume) / compliance;
  }
  return gas;
}

TEST(SheetChambers, AStepsPressureIsThatOfTheVolumeToWhichItLeads) {
  const Sheet sheet = closed_sheet(2, 5e-3);
  ChamberOptions given;
  given.law = "volume";
  given.volume_ratio = {{0, 1.2}};
  for (const double ratio : {1.05, 0.2, 40.0}) {
    const Chambers chambers(sheet, GasOptions(), {{"air", air(ratio)}});
    const double v0 = chambers.initial_volume(0);
    for (const double volume : {v0, 1e-3 * v0, 3 * v0, -0.5 * v0}) {
      for (const double compliance : {0.0, 1e-12 * v0, 1e-5 * v0, v0}) {
        if (volume < 0 && compliance == 0) {
          continue;
        }
        const GasState gas = moved_state(chambers, volume, compliance);
        const double balance = gas.volume - volume - compliance * gas.pressure;
        EXPECT_NEAR(balance, 0, 1e-12 * (std::abs(volume) + gas.volume + compliance * gas.absolute_pressure))
            << ratio << " " << volume / v0 << " " << compliance;
        EXPECT_DOUBLE_EQ(gas.pressure, chambers.state(0, gas.volume, 0).pressure);
      }
    }
  }
  const Chambers prescribed(sheet, GasOptions(), {{"air", given}});
  const double v0 = prescribed.initial_volume(0);
  const GasState gas = moved_state(prescribed, 1.1 * v0, 1e-6);
  EXPECT_NEAR(1.1 * v0 + 1e-6 * gas.pressure, 1.2 * v0, 1e-14 * v0);
  EXPECT_EQ(moved_state(Chambers(sheet, GasOptions(), {{"air", of_pressure(7)}}), v0, 1e-3).pressure, 7);
}

TEST(SheetChambers, FindsPiecesAndWhetherTheyAreClosed) {
  const Sheet sheet =
      make_sheet(PETSC_COMM_WORLD, joined(torus_mesh({12, 8}, 0.4, 0.1), rectangle_mesh({5, 4}, {0.2, 0.1}), {0, 0, 3}),
                 SheetOptions());
  ASSERT_EQ(sheet.pieces(), 2);
  EXPECT_EQ(sheet.piece_is_closed, (std::vector<bool>{true, false}));
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    EXPECT_EQ(sheet.piece[cell], sheet.element_id[cell] < 96 ? 0 : 1);
  }
  try {
    Chambers(sheet, GasOptions(), {{"air", air(1)}});
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(
        std::string(error.what()),
        "chambers.air_2.law: isothermal needs a volume, but the piece is open, expected a closed piece or the law "
        "pressure");
  }
  ChamberOptions ring = air(1);
  ring.vertex = 0;
  const Chambers chambers(sheet, GasOptions(), {{"ring", ring}});
  EXPECT_EQ(chambers.count(), 1);
  for (PetscInt triangle = 0; triangle < static_cast<PetscInt>(sheet.triangles.size()); ++triangle) {
    EXPECT_EQ(chambers.of_triangle(triangle), sheet.piece[triangle / 4] == 0 ? 0 : -1);
  }
}

}  // namespace
}  // namespace pellicle
