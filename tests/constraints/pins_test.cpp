#include "constraints/pins.h"

#include <gtest/gtest.h>

#include <set>

#include "base/error.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

/// A grid of 6 x 4 cells of edge 0.5: vertex ids run along x, 7 a row.
class PinsTest : public ::testing::Test {
 protected:
  PinsTest() {
    SurfaceMesh mesh = grid_mesh(6, 4, 0.5);
    mesh.groups["left"] = {0, 7, 14, 21, 28};
    SheetOptions options;
    options.thickness = 0.1;
    sheet = make_sheet(PETSC_COMM_WORLD, mesh, options);
  }

  /// Persistent ids of what is pinned on any rank.
  std::set<int> ids(const PinOptions& options) const {
    const Pins pins(sheet, {{"pin", options}});
    std::vector<int> found(sheet.particles.global, 0);
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      if (pins.pinned()[i]) {
        found[sheet.persistent_id[i]] = 1;
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, found.data(), static_cast<int>(found.size()), MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
    std::set<int> result;
    for (std::size_t id = 0; id < found.size(); ++id) {
      if (found[id] == 1) {
        result.insert(static_cast<int>(id));
      }
    }
    return result;
  }

  std::string message(const std::map<std::string, PinOptions>& options) const {
    try {
      Pins pins(sheet, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  Sheet sheet;
};

TEST_F(PinsTest, CornersAreFoundByTheirEnds) {
  PinOptions options;
  options.corners = {"all"};
  EXPECT_EQ(ids(options), (std::set<int>{0, 6, 28, 34}));
  options.corners = {"max_y"};
  EXPECT_EQ(ids(options), (std::set<int>{28, 34}));
  options.corners = {"min_x_max_y", "max_x_min_y"};
  EXPECT_EQ(ids(options), (std::set<int>{28, 6}));
}

TEST_F(PinsTest, BoxTakesTheLayersAskedFor) {
  PinOptions options;
  options.box = {1.1, 1.1, 1, -0.1, -0.1, -1};  // in any order: 3 x 3 corners round 2 x 2 cells
  options.layer = "corners";
  EXPECT_EQ(ids(options), (std::set<int>{0, 1, 2, 7, 8, 9, 14, 15, 16}));
  options.layer = "lattice";
  EXPECT_EQ(ids(options), (std::set<int>{35, 36, 41, 42}));
  options.layer = "both";
  EXPECT_EQ(ids(options).size(), 13U);
}

TEST_F(PinsTest, BallTakesWhatLiesInIt) {
  PinOptions options;
  options.centre = {1, 1, 0};
  options.radius = 0.51;  // more than the edge of a cell, less than its diagonal
  options.layer = "corners";
  EXPECT_EQ(ids(options), (std::set<int>{9, 15, 16, 17, 23}));
  options.layer = "both";  // lattice points: sqrt(2 * 0.25^2 + 0.1^2) = 0.37 away
  EXPECT_EQ(ids(options), (std::set<int>{9, 15, 16, 17, 23, 42, 43, 48, 49}));
}

TEST_F(PinsTest, VerticesAndGroupsAddUp) {
  PinOptions options;
  options.vertices = {3, 40};
  EXPECT_EQ(ids(options), (std::set<int>{3, 40}));
  options.group = "left";
  EXPECT_EQ(ids(options), (std::set<int>{0, 7, 14, 21, 28, 3, 40}));
}

TEST_F(PinsTest, PinnedParticlesFollowTheirPaths) {
  PinOptions moved;
  moved.corners = {"max_x"};
  moved.path = {{0, 0, 0, 0}, {2, 0, 0, 1}};
  PinOptions pushed;
  pushed.group = "left";
  pushed.velocity = {0.5, 0, 0};
  const Pins pins(sheet, {{"a", moved}, {"b", pushed}});
  Field positions(sheet.particles, 3);
  positions.values().setConstant(99);
  pins.impose(positions, 0.5);
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const int id = static_cast<int>(sheet.persistent_id[i]);
    Eigen::Vector3d expected(99, 99, 99);
    if (id == 6 || id == 34) {
      expected = sheet.rest.col(i) + Eigen::Vector3d(0, 0, 0.25);
    } else if (id < 35 && id % 7 == 0) {
      expected = sheet.rest.col(i) + Eigen::Vector3d(0.25, 0, 0);
    }
    EXPECT_EQ(positions.vector(i), expected) << id;
  }
}

TEST_F(PinsTest, ErrorsNameThePinAndTheSelector) {
  PinOptions options;
  EXPECT_EQ(message({{"left", options}}).rfind("pins.left: selects nothing", 0), 0U);
  options.corners = {"upper"};
  EXPECT_EQ(message({{"left", options}}).rfind("pins.left.corners: 'upper' names no corner", 0), 0U);
  options = PinOptions();
  options.vertices = {3, 5000};
  EXPECT_EQ(message({{"left", options}}).rfind("pins.left.vertices: 5000", 0), 0U);
  options = PinOptions();
  options.group = "right";
  EXPECT_EQ(message({{"left", options}}),
            "pins.left.group: 'right' is no group of the mesh, expected one of left; the nearest is left");
  options = PinOptions();
  options.box = {9, 9, 9, 10, 10, 10};
  EXPECT_EQ(message({{"left", options}}).rfind("pins.left.box:", 0), 0U);
  options = PinOptions();
  options.centre = {9, 9, 9};
  EXPECT_EQ(message({{"left", options}}), "pins.left.centre: given without a radius, expected both");
  options.radius = 1;
  EXPECT_EQ(message({{"left", options}}), "pins.left.radius: selects no particle, expected at least one");
  PinOptions corner;
  corner.vertices = {0};
  options = PinOptions();
  options.corners = {"all"};
  EXPECT_EQ(message({{"a", corner}, {"b", options}}),
            "pins.b: particle 0 is also held by pins.a, expected each particle in one pin");
}

}  // namespace
}  // namespace pellicle
