#include "constraints/constraints.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

SymmetryOptions plane(const Vector3d& point, const Vector3d& normal) {
  SymmetryOptions options;
  options.point = point;
  options.normal = normal;
  return options;
}

/// A grid of 6 x 4 cells of edge 0.5 in the plane z = 0 (vertex ids run along x, 7 a row), lattice points 0.1 above
/// it. Vertices 8 to 10 are a group.
class ConstraintsTest : public ::testing::Test {
 protected:
  ConstraintsTest() {
    SheetOptions options;
    options.thickness = 0.1;
    SurfaceMesh mesh = grid_mesh(6, 4, 0.5);
    mesh.groups["row"] = {8, 9, 10};
    sheet = make_sheet(PETSC_COMM_WORLD, mesh, options);
  }

  Constraints make(const std::map<std::string, SymmetryOptions>& planes,
                   const std::map<std::string, PinOptions>& pins = {}) const {
    return {sheet, planes, Pins(sheet, pins)};
  }

  /// Checks every local particle against the projector that `expected(id)` gives.
  template <class Expected>
  void expect_projectors(const Constraints& constraints, const Expected& expected) const {
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      const auto index = static_cast<std::size_t>(i);
      const int id = static_cast<int>(sheet.persistent_id[index]);
      const Matrix3d wanted = expected(id);
      EXPECT_LT((constraints.projectors[index] - wanted).cwiseAbs().maxCoeff(), 1e-15) << id;
    }
  }

  std::string message(const std::map<std::string, SymmetryOptions>& planes) const {
    try {
      make(planes);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  static Matrix3d along(double x, double y, double z) { return Vector3d(x, y, z).asDiagonal(); }
  static bool is_corner(int id) { return id < 35; }

  Sheet sheet;
};

TEST_F(ConstraintsTest, NothingGivenLeavesAllFree) {
  const Constraints constraints = make({});
  EXPECT_TRUE(constraints.planes.normals.empty());
  EXPECT_LT((constraints.origin - Vector3d(1.5, 1, 0.05)).norm(), 1e-14) << "the middle";
  expect_projectors(constraints, [](int) { return Matrix3d(Matrix3d::Identity()); });
}

TEST_F(ConstraintsTest, VerticesOfOnePlaneStayInIt) {
  const Constraints constraints = make({{"right", plane({3, 7, 8}, {-2, 0, 0})}});
  EXPECT_FALSE(constraints.planes.normals.empty());
  EXPECT_LT((constraints.origin - Vector3d(3, 1, 0.05)).norm(), 1e-14);
  expect_projectors(constraints, [](int id) { return is_corner(id) && id % 7 == 6 ? along(0, 1, 1) : along(1, 1, 1); });
}

TEST_F(ConstraintsTest, VerticesOfTwoAndThreePlanesKeepWhatIsCommon) {
  std::map<std::string, SymmetryOptions> planes{{"a", plane({0, 0, 0}, {1, 0, 0})}, {"b", plane({0, 0, 0}, {0, 3, 0})}};
  const auto on_edges = [](int id) { return along(is_corner(id) && id % 7 == 0 ? 0 : 1, id < 7 ? 0 : 1, 1); };
  EXPECT_LT((make(planes).origin - Vector3d(0, 0, 0.05)).norm(), 1e-14);
  expect_projectors(make(planes), on_edges);
  // A third through the same line, and the first once more from the other side, bar no other direction.
  planes["c"] = plane({0, 0, 0}, {1, 1, 0});
  planes["d"] = plane({0, 5, 0}, {-4, 0, 0});
  expect_projectors(make(planes), on_edges);
  planes["e"] = plane({0, 0, 0}, {0, 0, 1});
  expect_projectors(make(planes), [&](int id) {
    return is_corner(id) ? Matrix3d(on_edges(id) * along(1, 1, 0)) : Matrix3d(Matrix3d::Identity());
  });
  EXPECT_LT(make(planes).origin.norm(), 1e-14);
}

TEST_F(ConstraintsTest, APlaneWithAGroupHoldsItsVerticesOnly) {
  SymmetryOptions rim = plane({0, 0, 0}, {0, 0, 1});
  rim.group = "row";
  expect_projectors(make({{"rim", rim}}), [](int id) { return along(1, 1, id == 8 || id == 9 || id == 10 ? 0 : 1); });
  rim.group = "crew";
  EXPECT_NE(message({{"rim", rim}}).find("symmetry.rim.group: "), std::string::npos) << message({{"rim", rim}});
}

TEST_F(ConstraintsTest, SkewPlanesGiveOrthogonalProjectors) {
  const Vector3d first(1, 2, 2);
  const Vector3d second(2, 1, -1);
  const Vector3d line = first.cross(second).normalized();
  const Constraints constraints = make({{"a", plane({1, 1, 0}, first)}, {"b", plane({1, 1, 0}, second)}});
  EXPECT_NEAR(first.dot(constraints.origin - Vector3d(1, 1, 0)), 0, 1e-14);
  EXPECT_NEAR(second.dot(constraints.origin - Vector3d(1, 1, 0)), 0, 1e-14);
  int found = 0;
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    const auto index = static_cast<std::size_t>(i);
    if (sheet.persistent_id[index] == 16) {  // at 1, 1
      ++found;
      EXPECT_LT((constraints.projectors[index] - line * line.transpose()).norm(), 1e-14);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &found, 1, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_EQ(found, 1);
}

TEST_F(ConstraintsTest, PinnedVerticesDoNotMove) {
  PinOptions constrained;
  constrained.vertices = {3, 7, 40};
  expect_projectors(make({{"left", plane({0, 0, 0}, {1, 0, 0})}}, {{"held", constrained}}), [](int id) {
    return id == 3 || id == 7 || id == 40 ? along(0, 0, 0)
           : is_corner(id) && id % 7 == 0 ? along(0, 1, 1)
                                          : along(1, 1, 1);
  });
}

TEST_F(ConstraintsTest, ErrorsNameThePlaneAndTheValue) {
  EXPECT_EQ(message({{"x", plane({0, 0, 0}, {0, 0, 0})}}),
            "symmetry.x.normal: 0, 0, 0 given, expected a vector that is not zero");
  EXPECT_EQ(message({{"x", plane({-0.25, 0, 0}, {1, 0, 0})}}),
            "symmetry.x: the nearest vertex is 0.25 m away, expected vertices in the plane");
  EXPECT_EQ(message({{"low", plane({0, 0, 0}, {1, 0, 0})}, {"up", plane({3, 0, 0}, {1, 0, 0})}}),
            "symmetry.up: shares no point with the planes named before it, expected planes that all meet in one");
  // Three planes round a prism meet two at a time.
  EXPECT_EQ(
      message(
          {{"a", plane({0, 0, 0}, {1, 0, 0})}, {"b", plane({0, 0, 0}, {0, 1, 0})}, {"c", plane({1, 1, 0}, {1, 1, 0})}})
          .rfind("symmetry.c: shares no point", 0),
      0U);
}

}  // namespace
}  // namespace pellicle
