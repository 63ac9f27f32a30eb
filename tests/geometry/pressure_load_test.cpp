#include "geometry/pressure_load.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "tests/support/pressure_action.h"

namespace pellicle {
namespace {

using Triangle = std::array<int, 3>;

/// The octahedron with corners at +x, -x, +y, -y, +z, -z, or its upper half, which the plane z = 0 closes.
const std::vector<Triangle> upper_half{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}};
const std::vector<Triangle> whole{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                  {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};

Eigen::Matrix3Xd octahedron(double radius) {
  Eigen::Matrix3Xd corners(3, 6);
  corners << 1, -1, 0, 0, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0, 0, 0, 1, -1;
  return radius * corners;
}

/// No two coordinates alike; the first four corners stay in z = 0.
Eigen::Matrix3Xd crooked() {
  Eigen::Matrix3Xd corners = octahedron(0.5);
  for (Eigen::Index i = 0; i < corners.size(); ++i) {
    corners.data()[i] += 0.05 * std::sin(3.0 * static_cast<double>(i) + 1);
  }
  corners.block<1, 4>(2, 0).setZero();
  return corners;
}

double volume(const std::vector<Triangle>& surface, const Eigen::Matrix3Xd& x) {
  double sum = 0;
  for (const auto& [a, b, c] : surface) {
    sum += enclosed_volume(x.col(a), x.col(b), x.col(c));
  }
  return sum;
}

/// Balloon paper, eq. 15.
Eigen::VectorXd pressure_force(double pressure, const std::vector<Triangle>& surface, const Eigen::Matrix3Xd& x) {
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, x.cols());
  for (const Triangle& triangle : surface) {
    for (const int corner : triangle) {
      force.col(corner) += pressure / 3 * area_vector(x.col(triangle[0]), x.col(triangle[1]), x.col(triangle[2]));
    }
  }
  return force.reshaped();
}

/// The load's stiffness, column by column from its action.
Eigen::MatrixXd stiffness(double pressure, const std::vector<Triangle>& surface, const Eigen::Matrix3Xd& x) {
  Eigen::MatrixXd sum(x.size(), x.size());
  for (Eigen::Index column = 0; column < x.size(); ++column) {
    Eigen::Matrix3Xd w = Eigen::Matrix3Xd::Zero(3, x.cols());
    Eigen::Matrix3Xd product = w;
    w.data()[column] = 1;
    for (const Triangle& triangle : surface) {
      add_pressure_stiffness_action(pressure, triangle, x, w, product);
    }
    sum.col(column) = product.reshaped();
  }
  return sum;
}

/// Minus the derivative of eq. 15's force. Exact but for rounding: the force is quadratic.
Eigen::MatrixXd difference_stiffness(double pressure, const std::vector<Triangle>& surface, const Eigen::Matrix3Xd& x) {
  constexpr double step = 0.1;
  Eigen::MatrixXd result(x.size(), x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    Eigen::Matrix3Xd forward = x;
    Eigen::Matrix3Xd backward = x;
    forward.data()[i] += step;
    backward.data()[i] -= step;
    result.col(i) =
        -(pressure_force(pressure, surface, forward) - pressure_force(pressure, surface, backward)) / (2 * step);
  }
  return result;
}

constexpr double pressure = 700;  // [Pa]

TEST(PressureLoad, VolumeOfAnOctahedron) {
  EXPECT_NEAR(volume(whole, octahedron(0.5)), 4.0 / 3 * 0.125, 1e-15);
  EXPECT_NEAR(volume(upper_half, octahedron(0.5)), 2.0 / 3 * 0.125, 1e-15);
  const Eigen::Matrix3Xd moved = crooked().colwise() + Eigen::Vector3d(1, -2, 0.5);
  EXPECT_NEAR(volume(whole, moved), volume(whole, crooked()), 1e-14);
}

TEST(PressureLoad, StiffnessOfAClosedSurfaceIsTheDerivativeOfTheForce) {
  const Eigen::Matrix3Xd x = crooked();
  const Eigen::MatrixXd exact = difference_stiffness(pressure, whole, x);
  EXPECT_GT(exact.norm(), 100);
  EXPECT_LT((stiffness(pressure, whole, x) - exact).norm(), 1e-12 * exact.norm());
  EXPECT_LT((exact - exact.transpose()).norm(), 1e-12 * exact.norm());
  const Eigen::Matrix3Xd moved = x.colwise() + Eigen::Vector3d(1, -2, 0.5);
  EXPECT_LT((stiffness(pressure, whole, moved) - exact).norm(), 1e-12 * exact.norm());
}

TEST(PressureLoad, RimsLeadToTheSymmetricPart) {
  const Eigen::Matrix3Xd x = crooked();
  const Eigen::MatrixXd exact = difference_stiffness(pressure, upper_half, x);
  EXPECT_GT((exact - exact.transpose()).norm(), 1e-2 * exact.norm());
  Eigen::MatrixXd sum = stiffness(pressure, upper_half, x);
  EXPECT_LT((sum - exact).norm(), 1e-12 * exact.norm());
  for (const Triangle& triangle : upper_half) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int from = triangle[k];
      const int to = triangle[(k + 1) % 3];
      if (from < 4 && to < 4) {  // corners of the rim
        const Eigen::Matrix3d block = rim_stiffness(pressure, x.col(from), x.col(to));
        sum.block<3, 3>(3 * from, 3 * to) += block;
        sum.block<3, 3>(3 * to, 3 * from) += block;
        sum.block<3, 3>(3 * from, 3 * from) += 2 * block;
        sum.block<3, 3>(3 * to, 3 * to) += 2 * block;
      }
    }
  }
  EXPECT_LT((sum - (exact + exact.transpose()) / 2).norm(), 1e-12 * exact.norm());
}

TEST(PressureLoad, StiffnessOfASurfaceThatAPlaneClosesIsSymmetric) {
  const Eigen::Matrix3Xd x = crooked();
  Eigen::VectorXd free = Eigen::VectorXd::Ones(x.size());
  for (int corner = 0; corner < 4; ++corner) {
    free[3 * corner + 2] = 0;  // bound to z = 0
  }
  const Eigen::MatrixXd bound = free.asDiagonal() * stiffness(pressure, upper_half, x) * free.asDiagonal();
  EXPECT_LT((bound - bound.transpose()).norm(), 1e-12 * bound.norm());
}

}  // namespace
}  // namespace pellicle
