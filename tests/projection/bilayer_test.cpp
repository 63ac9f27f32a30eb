// Bilayer (Timoshenko): a strip whose corner layer shrinks bends to the curvature that follows from the two lengths.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/projection/sheets.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

/// Curvature of the circle through points of a plane curve in x and z: x^2 + z^2 + a x + b z + c = 0, least squares.
double fitted_curvature(const std::vector<Eigen::Vector3d>& points) {
  Eigen::MatrixX3d matrix(points.size(), 3);
  Eigen::VectorXd right(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    matrix.row(static_cast<Eigen::Index>(k)) << points[k].x(), points[k].z(), 1;
    right[static_cast<Eigen::Index>(k)] = -points[k].x() * points[k].x() - points[k].z() * points[k].z();
  }
  const Eigen::Vector3d fit = matrix.colPivHouseholderQr().solve(right);
  return 1 / std::sqrt((fit[0] * fit[0] + fit[1] * fit[1]) / 4 - fit[2]);
}

TEST(CircleFit, IsExactOnACircle) {
  std::vector<Eigen::Vector3d> points;
  for (const double angle : {0.1, 0.2, 0.35, 0.6}) {
    points.emplace_back(1 + 2.5 * std::cos(angle), 7.0, -2 + 2.5 * std::sin(angle));
  }
  EXPECT_NEAR(fitted_curvature(points), 0.4, 1e-12);
}

/// A strip whose corner layer has shrunk.
struct Strip {
  int cells = 8;  ///< along it
  int width = 1;  ///< cells across
  double shrinkage = 0;
  bool is_uniaxial = false;  ///< shrinks along the strip only

  static constexpr double length = 1;
  static constexpr double thickness = 1.0 / 16;

  double edge() const { return length / cells; }
};

/// Curvature of the lattice layer in the shape in which every spring has its length.
///
/// With edge e, thickness t and shrinkage s all corners lie on a circle of radius R_c, the lattice points on R_l,
/// turned by theta from cell to cell: 2 R_c sin(theta/2) = (1 - s) e (blue), 2 R_l sin(theta/2) = e (green). The
/// corners of a cell stay a rectangle (yellow) with edges (1 - s) e and w = (1 - s) e, or e when it shrinks along the
/// strip only. Red, as at rest: (R_l - R_c cos(theta/2))^2 + ((1 - s)^2 e^2 + w^2)/4 = t^2 + e^2/2.
double exact_curvature(const Strip& strip) {
  const double left = 1 - strip.shrinkage;
  const double edge = strip.edge();
  const double height =
      std::sqrt(Strip::thickness * Strip::thickness + edge * edge * (1 - left * left) / (strip.is_uniaxial ? 4 : 2));
  // e (1 - (1 - s) cos(theta/2)) = 2 height sin(theta/2), by Newton's method.
  double half = strip.shrinkage * edge / (2 * height);
  for (int k = 0; k < 50; ++k) {
    const double residual = edge * (1 - left * std::cos(half)) - 2 * height * std::sin(half);
    half -= residual / (edge * left * std::sin(half) - 2 * height * std::cos(half));
  }
  return 2 * std::sin(half) / edge;
}

struct Bent {
  double curvature = 0;  ///< of the lattice layer, whose lengths do not change
  double distance = 0;   ///< between the layers: lattice points from the middle of their corners
  double error = 0;      ///< ||C||
  int steps = 0;
};

/// Projects until all lengths are kept. Collective.
Bent bend(const Strip& strip) {
  SheetOptions sheet_options;
  sheet_options.thickness = Strip::thickness;
  Scene scene(make_sheet(PETSC_COMM_WORLD, grid_mesh(strip.cells, strip.width, strip.edge()), sheet_options));
  for (const Colour colour : {Colour::blue, Colour::yellow}) {
    const SpringSet& springs = scene.sheet.of(colour);
    for (std::size_t s = 0; s < springs.ends.size(); ++s) {
      Eigen::Vector3d line = scene.sheet.rest.col(springs.ends[s][0]) - scene.sheet.rest.col(springs.ends[s][1]);
      line.x() *= 1 - strip.shrinkage;
      line.y() *= strip.is_uniaxial ? 1 : 1 - strip.shrinkage;
      scene.target[static_cast<std::size_t>(colour)][s] = line.norm();
    }
  }
  ProjectOptions options = tight_options();
  options.max_steps = 50;
  SuccessiveProjection projection(scene.sheet, options);
  Bent bent;
  bent.error = 1;
  while (bent.error > 1e-8 && bent.steps < 10000) {
    const StageResult result = projection.advance(scene.x, scene.input());
    EXPECT_TRUE(result.converged) << result.reason;
    bent.error = result.error;
    bent.steps += options.max_steps;
  }
  const Eigen::Matrix3Xd x = by_id(scene.sheet, scene.x);
  std::vector<Eigen::Vector3d> line;
  for (int cell = 0; cell < strip.cells; ++cell) {
    line.emplace_back(x.col(scene.sheet.first_lattice_id + cell));
    const Eigen::Vector3d middle =
        (x.col(cell) + x.col(cell + 1) + x.col(cell + strip.cells + 1) + x.col(cell + strip.cells + 2)) / 4;
    bent.distance += (line.back() - middle).norm() / strip.cells;
  }
  bent.curvature = fitted_curvature(line);
  return bent;
}

/// Shrinks strips of three fine grids and compares curvatures.
void expect_bilayer(Strip strip) {
  double last_error = 0;
  // Many small solves: several ranks do the first grid only.
  const std::vector<int> grids = ranks() == 1 ? std::vector<int>{8, 16, 32} : std::vector<int>{8};
  for (const int cells : grids) {  // The thickness is a half, one and two cells.
    strip.cells = cells;
    const Bent bent = bend(strip);
    EXPECT_LE(bent.error, 1e-8) << "not converged after " << bent.steps << " steps";
    const double exact = exact_curvature(strip);
    EXPECT_NEAR(bent.curvature, exact, 1e-5 * exact);
    // The continuous bilayer. The red springs keep their length while the cell below them shrinks, so the distance of
    // the layers is a little more than the thickness.
    const double error = std::abs(bent.curvature * bent.distance / strip.shrinkage - 1);
    EXPECT_LT(error, 0.02);
    if (last_error > 0) {
      EXPECT_LT(error, last_error / 3) << "second order";
    }
    last_error = error;
    print_once("bilayer %d x %d, shrinkage %g: %d steps, curvature %.5f, exact %.5f, error %.3g of s/d, %.3g of s/t\n",
               cells, strip.width, strip.shrinkage, bent.steps, bent.curvature, exact, error,
               bent.curvature * Strip::thickness / strip.shrinkage - 1);
  }
}

class Bilayer : public ::testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(shrinkage, Bilayer, ::testing::Values(0.005, 0.01, 0.02));

TEST_P(Bilayer, StripOfOneCellBends) {
  Strip strip;
  strip.shrinkage = GetParam();
  expect_bilayer(strip);
}

TEST_P(Bilayer, WideStripThatShrinksLengthwiseBends) {
  Strip strip;
  strip.width = 3;
  strip.shrinkage = GetParam();
  strip.is_uniaxial = true;
  expect_bilayer(strip);
}

}  // namespace
}  // namespace pellicle
