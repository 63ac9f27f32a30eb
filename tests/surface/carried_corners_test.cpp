#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>
#include <vector>

#include "surface/sheet.h"
#include "surface/shell.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

/// Two layers of 2 x 2 cells that are not flat, of which some corners have left, turned, shifted and shrunk.
/// Corners 0 to 8, lattice points 9 to 12.
class CarriedCorners : public ::testing::TestWithParam<int> {
 protected:
  /// @param removed ids of corners that have left; they are left behind at their undeformed places
  void remove(const std::set<PetscInt>& removed) {
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      const bool is_removed = removed.count(sheet.persistent_id[i]) > 0;
      mass.data()[i] = is_removed ? 0 : sheet.initial_mass[i];
      position.vector(i) = is_removed ? Eigen::Vector3d(sheet.rest.col(i)) : moved(sheet.rest.col(i));
    }
  }
  static Eigen::Vector3d moved(const Eigen::Vector3d& rest) {
    const Eigen::AngleAxisd rotation(2.5, Eigen::Vector3d(1, 2, -1).normalized());
    return 0.7 * (rotation * rest) + Eigen::Vector3d(0.3, 0, -5);
  }
  /// Carries the corners. Expects that ghosts are up to date. @returns the ids of those that have been carried
  std::set<PetscInt> carry() {
    std::vector<bool> carried;
    carry_removed_corners(sheet, active, mass, pinned, position, carried);
    Field flags(sheet.particles, 1);
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      flags.data()[i] = carried[i] ? 1 : 0;
    }
    for (Field* field : {&flags, &position}) {
      const Eigen::MatrixXd before = field->values();
      field->update_ghosts();
      EXPECT_EQ(before, Eigen::MatrixXd(field->values())) << "ghosts";
    }
    std::set<PetscInt> ids;
    const Eigen::MatrixXd all = by_id(sheet, flags);
    for (Eigen::Index id = 0; id < all.cols(); ++id) {
      if (all(0, id) == 1) {
        ids.insert(static_cast<PetscInt>(id));
      }
    }
    return ids;
  }

  Sheet sheet = make_sheet(PETSC_COMM_WORLD, irregular_mesh(2, 2, 0.1), options());
  std::vector<bool> active = std::vector<bool>(sheet.triangles.size(), true);
  std::vector<bool> pinned = std::vector<bool>(sheet.particles.local(), false);
  Field mass{sheet.particles, 1};
  Field position{sheet.particles, 3};

 private:
  static SheetOptions options() {
    SheetOptions options;
    options.layers = GetParam();
    options.thickness = 0.04;
    return options;
  }
};

TEST_P(CarriedCorners, GoWhereTheRestOfTheirQuadsIs) {
  remove({0, 1, 5});
  EXPECT_EQ(carry(), (std::set<PetscInt>{0, 1, 5}));
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    EXPECT_LE((position.vector(i) - moved(sheet.rest.col(i))).norm(), 1e-14) << sheet.persistent_id[i];
  }
}

TEST_P(CarriedCorners, StayWithoutARemainingTriangleOrIfPinned) {
  remove({0, 8});
  for (PetscInt e = 0; e < sheet.elements.local(); ++e) {
    if (sheet.persistent_id[sheet.lattice[e]] == 9) {  // the only quad of corner 0
      std::fill_n(active.begin() + 4 * e, 4, false);
    }
  }
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    pinned[i] = sheet.persistent_id[i] == 8;
  }
  const Eigen::Matrix3Xd before = position.values();
  EXPECT_EQ(carry(), std::set<PetscInt>());
  EXPECT_EQ(before, Eigen::Matrix3Xd(position.values()));
}

INSTANTIATE_TEST_SUITE_P(Layers, CarriedCorners, ::testing::Values(1, 2));

}  // namespace
}  // namespace pellicle
