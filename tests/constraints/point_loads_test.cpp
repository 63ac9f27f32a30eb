#include "constraints/point_loads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "base/error.h"
#include "geometry/principal_axes.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A grid of 6 x 4 cells of edge 0.5 in the plane z = 0 (vertex ids run along x, 7 a row). The area round the vertex of
/// an id is made up.
class PointLoadsTest : public ::testing::Test {
 protected:
  PointLoadsTest() {
    SheetOptions options;
    options.thickness = 0.1;
    sheet = make_sheet(PETSC_COMM_WORLD, grid_mesh(6, 4, 0.5), options);
    for (const PetscInt id : sheet.persistent_id) {
      areas.push_back(area(id));
    }
  }

  static double area(PetscInt id) { return 1e-4 * static_cast<double>(1 + id % 5); }

  PointLoads make(const std::map<std::string, AttachmentOptions>& attachments,
                  const std::map<std::string, PushOptions>& forces = {}) const {
    return {sheet, areas, attachments, forces};
  }

  std::string message(const std::map<std::string, AttachmentOptions>& attachments,
                      const std::map<std::string, PushOptions>& forces) const {
    try {
      make(attachments, forces);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  /// Sum of a vector over the owned particles of all ranks.
  Vector3d sum(const std::function<Vector3d(PetscInt)>& of) const {
    Vector3d total = Vector3d::Zero();
    for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
      total += of(i);
    }
    MPI_Allreduce(MPI_IN_PLACE, total.data(), 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return total;
  }

  /// Compares the gradient with differences of the value, and the Hessian with those of the gradient, less what is left
  /// out of it; and no direction has a negative curvature.
  static void expect_derivatives(const PointLoads& loads, PetscInt i, const Vector3d& x, double step,
                                 const Matrix3d& left_out = Matrix3d::Zero()) {
    const PointPotential at = loads.at(i, x);
    Vector3d gradient;
    Matrix3d hessian;
    for (int axis = 0; axis < 3; ++axis) {
      const PointPotential before = loads.at(i, x - step * Vector3d::Unit(axis));
      const PointPotential after = loads.at(i, x + step * Vector3d::Unit(axis));
      gradient[axis] = (after.value - before.value) / (2 * step);
      hessian.col(axis) = (after.gradient - before.gradient) / (2 * step);
    }
    EXPECT_LT((at.gradient - gradient).norm(), 1e-6 * at.gradient.norm());
    EXPECT_LE((at.hessian + left_out - hessian).norm(), 1e-6 * (at.hessian.norm() + left_out.norm()));
    const Vector3d curvatures = principal_axes(at.hessian).values;
    EXPECT_GE(curvatures.minCoeff(), -1e-12 * at.hessian.norm());
    EXPECT_LE((at.hessian - at.hessian.transpose()).norm(), 1e-14 * at.hessian.norm());
  }

  Sheet sheet;
  std::vector<double> areas;
};

TEST_F(PointLoadsTest, NothingGivenIsEmpty) { EXPECT_TRUE(make({}).empty()); }

TEST_F(PointLoadsTest, AttachmentsPullToTheirMovingPlaces) {
  AttachmentOptions spring;
  spring.vertices = {8, 9, 10};
  spring.path = {{0, 0, 0, 0}, {2, 0, 0, 0.2}};
  spring.total_stiffness = 300;
  PointLoads loads = make({{"spring", spring}});
  EXPECT_FALSE(loads.empty());
  loads.set_time(1);
  const double total = area(8) + area(9) + area(10);
  const Vector3d displacement(0.01, 0.02, -0.03);
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const PetscInt id = sheet.persistent_id[i];
    const Vector3d x = sheet.rest.col(i) + displacement;
    const double stiffness = id >= 8 && id <= 10 ? 300 * area(id) / total : 0;
    const Vector3d stretch(0.01, 0.02, -0.13);
    EXPECT_NEAR(loads.at(i, x).value, stiffness / 2 * stretch.squaredNorm(), 1e-13);
    EXPECT_LT((loads.at(i, x).gradient - stiffness * stretch).norm(), 1e-12);
    if (stiffness > 0) {
      expect_derivatives(loads, i, x, 1e-4);
    }
  }
}

TEST_F(PointLoadsTest, ForcesAddUpToWhatIsGiven) {
  PushOptions push;
  push.box = {0.9, 0.9, -1, 2.1, 2.1, 1};
  push.layer = "corners";
  push.force = {{0, 0, 0, 0}, {2, 4, 6, -8}};
  PushOptions weight;
  weight.vertices = {0};
  weight.force = {{0, 0, 0, -1}};  // a single key point is a constant
  PointLoads loads = make({}, {{"push", push}, {"weight", weight}});
  loads.set_time(0.5);
  const auto force = [&](PetscInt i) -> Vector3d { return -loads.at(i, sheet.rest.col(i)).gradient; };
  EXPECT_LT((sum(force) - Vector3d(1, 1.5, -3)).norm(), 1e-13);
  double total = 0;
  for (const int id : {16, 17, 18, 23, 24, 25, 30, 31, 32}) {
    total += area(id);
  }
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    if (sheet.persistent_id[i] == 24) {
      EXPECT_LT((force(i) - area(24) / total * Vector3d(1, 1.5, -2)).norm(), 1e-13);
      const Vector3d displacement(0.1, 0.2, 0.3);
      EXPECT_NEAR(loads.at(i, sheet.rest.col(i) + displacement).value, -force(i).dot(displacement), 1e-13);
      expect_derivatives(loads, i, sheet.rest.col(i) + displacement, 1e-4);
    }
  }
}

TEST_F(PointLoadsTest, ErrorsNameTheObjectAndTheKey) {
  AttachmentOptions spring;
  EXPECT_EQ(message({{"spring", spring}}, {}).rfind("attachments.spring: selects nothing", 0), 0U);
  spring.vertices = {3};
  spring.path = {{0, 0, 0, 0}, {0, 1, 1, 1}};
  EXPECT_EQ(message({{"spring", spring}}, {}).rfind("attachments.spring.path: key point 2 is at 0", 0), 0U);
  PushOptions push;
  push.vertices = {3};
  EXPECT_EQ(message({}, {{"push", push}}),
            "forces.push.force: no key points given, expected at least one: time, x, y, z");
  push.force = {{0, 1, 1}};
  EXPECT_EQ(message({}, {{"push", push}}), "forces.push.force: key point 1 has 3 numbers, expected 4: time, x, y, z");
  push.force = {{0, 1, 1, 1}};
  push.vertices = {9999};
  EXPECT_EQ(message({}, {{"push", push}}).rfind("forces.push.vertices: 9999", 0), 0U);
}

}  // namespace
}  // namespace pellicle
