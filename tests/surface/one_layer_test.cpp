#include <gtest/gtest.h>

#include <numeric>

#include "surface/sheet.h"
#include "surface/shell.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

/// A strip of 3 x 1 cells of one layer; corners 0 to 3 below, 4 to 7 above, lattice points 8 to 10.
class OneLayer : public ::testing::Test {
 protected:
  OneLayer() {
    mass.values() = Eigen::Map<const Eigen::RowVectorXd>(sheet.initial_mass.data(), sheet.particles.local());
  }

  static SheetOptions options() {
    SheetOptions options;
    options.layers = 1;
    options.areal_density = 8;  // a corner's fraction of a cell is 1e-2 kg
    return options;
  }

  Eigen::RowVectorXd masses() const {
    Field all(sheet.particles, 1);
    const std::vector<double> of_corners = corner_masses(sheet, mass);
    all.values() = Eigen::Map<const Eigen::RowVectorXd>(of_corners.data(), sheet.particles.local());
    const Eigen::MatrixXd owned = by_id(sheet, all);
    all.update_ghosts();
    EXPECT_EQ(Eigen::RowVectorXd(all.values()),
              Eigen::RowVectorXd(Eigen::Map<const Eigen::RowVectorXd>(of_corners.data(), sheet.particles.local())))
        << "ghosts";
    return owned.row(0);
  }

  /// Burns particles of these ids to nothing.
  void burn(const std::vector<PetscInt>& ids) {
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      if (std::count(ids.begin(), ids.end(), sheet.persistent_id[i]) > 0) {
        mass.data()[i] = 0;
      }
    }
  }

  Sheet sheet = make_sheet(PETSC_COMM_WORLD, grid_mesh(3, 1, 0.1), options());
  Field mass{sheet.particles, 1};
};

TEST_F(OneLayer, LatticePointsLieInTheLayer) {
  EXPECT_EQ(sheet.layers, 1);
  EXPECT_TRUE(sheet.acts(Colour::blue));
  EXPECT_FALSE(sheet.acts(Colour::green));
  EXPECT_TRUE(sheet.rest.row(2).isZero(0));
}

TEST_F(OneLayer, CornersCarryAllMass) {
  Eigen::RowVectorXd expected(11);
  expected << 2, 4, 4, 2, 2, 4, 4, 2, 0, 0, 0;
  EXPECT_LE((masses() - 1e-2 * expected).cwiseAbs().maxCoeff(), 1e-15);
}

TEST_F(OneLayer, WhatIsLeftOfALatticePointFallsToTheCornersThatAreLeft) {
  burn({0, 10});
  Eigen::RowVectorXd expected(11);
  const double fraction = 1 + 4.0 / 3;  // of the first cell
  expected << 0, fraction + 2, 3, 1, fraction, fraction + 2, 3, 1, 0, 0, 0;
  EXPECT_LE((masses() - 1e-2 * expected).cwiseAbs().maxCoeff(), 1e-15);
}

TEST_F(OneLayer, LatticePointsFollow) {
  Field values(sheet.particles, 3);
  values.values() = (7 * sheet.rest).array().sin();
  const Eigen::Matrix3Xd before = values.values();
  follow_corners(sheet, values);
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const PetscInt corner : sheet.cells[cell]) {
      EXPECT_EQ(Eigen::Vector3d(values.vector(corner)), Eigen::Vector3d(before.col(corner)));
      mean += before.col(corner) / 4;
    }
    EXPECT_LE((values.vector(sheet.lattice[cell]) - mean).norm(), 1e-15);
  }
}

}  // namespace
}  // namespace pellicle
