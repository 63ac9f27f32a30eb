// Walls that bear no compression, by cases of the literature: the Mylar balloon and the bent band.

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "meshing/generators.h"
#include "parallel/collective.h"
#include "prism/metric_energy.h"
#include "tests/support/print_once.h"
#include "tests/support/solver_options.h"
#include "tests/world/static_balloon.h"

namespace pellicle::tension_field_cases_test {
namespace {

/// Two discs, joined at their rims, are blown up: the mean of the rim's radii, the thickness from pole to pole and the
/// volume, in radii of the discs.
struct Mylar {
  double radius = 0;
  double thickness = 0;
  double volume = 0;
};

Mylar mylar_balloon(int rings, double slack_tension) {
  constexpr double radius = 0.1;    // a [m]
  constexpr double pressure = 200;  // p a / (E h) = 2e-4: it hardly stretches
  Options options = static_plate_options(1e9, 0.3, 1e-4);
  options.wall.wrinkling = "tension_field";
  options.wall.slack_tension = slack_tension;
  options.prism.mass_damping = 1000;
  options.symmetry["rim"].normal = {0, 0, 1};
  options.symmetry["rim"].group = "rim";
  options.chambers["inside"].law = "pressure";
  options.chambers["inside"].pressure = {{0, pressure}};
  StaticBalloon balloon(disc_mesh(rings, radius), options);
  // As long as it moves, a step that is too long for Newton's method is tried again with half its length.
  constexpr double longest = 5e-3;
  double h = 2e-4;
  double before = 0;
  for (int tries = 0; tries < 300; ++tries) {
    balloon.object.keep();
    if (!balloon.step_to(balloon.state().time + h).converged) {
      balloon.object.restore();
      h /= 2;
      continue;
    }
    const double volume = balloon.volume();
    if (h > longest / 2 && std::abs(volume - before) < 1e-6 * volume) {
      break;
    }
    before = volume;
    h = std::min(1.3 * h, longest);
  }
  Mylar found;
  double at_rim = 0;
  for (PetscInt i = 0; i < balloon.membrane().particles.owned; ++i) {
    const Eigen::Vector3d x = balloon.state().position.vector(i) / radius;
    const double rest = balloon.membrane().rest.col(i).norm() / radius;
    found.thickness += rest < 1e-9 ? 2 * x.z() : 0;
    found.radius += rest > 1 - 1e-9 ? x.head<2>().norm() : 0;
    at_rim += rest > 1 - 1e-9 ? 1 : 0;
  }
  found.thickness = sum_over_ranks(PETSC_COMM_WORLD, found.thickness);
  found.radius = sum_over_ranks(PETSC_COMM_WORLD, found.radius) / sum_over_ranks(PETSC_COMM_WORLD, at_rim);
  found.volume = 2 * balloon.volume() / std::pow(radius, 3);
  print_once("  %d rings, slack tension %g: radius %.5f, thickness %.5f, volume %.5f; %d Newton iterations, %.3f s\n",
             rings, slack_tension, found.radius, found.thickness, found.volume, balloon.newton_iterations,
             balloon.state().time);
  return found;
}

TEST(TensionFieldCases, MylarBalloon) {
  if (ranks() > 1) {
    GTEST_SKIP() << "on one rank only";
  }
  // Paulsen, What is the shape of a Mylar balloon? (1994)
  for (const auto& [rings, slack_tension] : {std::pair{8, 1e-6}, {8, 5e-7}, {12, 1e-6}}) {
    const Mylar found = mylar_balloon(rings, slack_tension);
    const double bound = rings < 12 ? 0.025 : 0.01;
    EXPECT_NEAR(found.radius, 0.76276, bound * 0.76276);
    EXPECT_NEAR(found.thickness, 0.91389, bound * 0.91389);
    EXPECT_NEAR(found.volume, 1.21852, bound * 1.21852);
  }
}

/// The right half of a band of height 1 and length 2, by rows of square cells, in tension s across and along: its end
/// is moved and turned so far that the stress along it is zero at the height b.
struct Band {
  double moment = 0;    ///< M/(P H) of the middle section
  double wrinkled = 0;  ///< fraction of the height where nothing is borne along it
};

Band bent_band(int rows, double b) {
  constexpr double height = 1;
  constexpr double young = 1e6;
  constexpr double thickness = 1e-3;
  constexpr double curvature = 2e-3;  // [1/m]
  constexpr double across = 1e-4;     // strain
  Options options = static_plate_options(young, 0, thickness);
  options.wall.wrinkling = "tension_field";
  options.wall.slack_tension = 1e-7;
  options.symmetry["middle"].normal = {1, 0, 0};
  const SurfaceMesh mesh = square_mesh({rows, rows}, {height, height});
  const double edge = height / rows;
  for (int j = 0; j <= rows; ++j) {
    const double y = j * edge;
    PinOptions& pin = options.pins["row" + std::to_string(j)];
    pin.box = {height - 1e-6, y - 1e-6, -1, 2, y + 1e-6, 1};
    pin.path = {{0, 0, 0, 0},
                {1, curvature * height * (y - b), -curvature * height * height / 2 + across * (y - height / 2), 0}};
  }
  for (const double side : {0.0, 1.0}) {
    const std::string name = side > 0 ? "top" : "bottom";
    options.forces[name].box = {-1, side - 1e-6, -1, 2, side + 1e-6, 1};
    options.forces[name].force = {{0, 0, 0, 0}, {1, 0, (2 * side - 1) * across * young * thickness * height, 0}};
  }
  StaticBalloon band(mesh, options);
  for (int step = 1; step <= 4; ++step) {
    band.reach(0.25 * step);
  }
  const auto& wall = band.elements();
  const Membrane& membrane = band.membrane();
  const std::vector<Eigen::Matrix3d> tensions = wall.tensions(band.state().position, band.state().thickness_ratio);
  std::array<double, 4> sums{};  // force, moment, wrinkled and whole area, of the elements in the middle
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    const auto& [p, q, r] = membrane.triangles[e];
    const Eigen::Vector3d at = (membrane.rest.col(p) + membrane.rest.col(q) + membrane.rest.col(r)) / 3;
    if (at.x() < edge) {
      const double area = wall.wall().rest[e].area;
      const double along = tensions[e](0, 0);
      sums[0] += along * area / edge;
      sums[1] += along * area / edge * (at.y() - height / 2);
      sums[2] += along < 0.5 * curvature * edge / 2 * young * thickness ? area : 0;
      sums[3] += area;
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 4, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  return {sums[1] / (sums[0] * height), sums[2] / sums[3]};
}

TEST(TensionFieldCases, BentBand) {
  for (const double b : {0.1, 0.25, 0.5, 0.75}) {
    // The finest mesh, which takes longest, for one band that is wrinkled little and one that is wrinkled much.
    const bool has_finest = b == 0.1 || b == 0.75;
    for (const int rows : has_finest ? std::vector<int>{8, 16, 32} : std::vector<int>{8, 16}) {
      const Band found = bent_band(rows, b);
      const double expected = 3 * found.moment - 0.5;
      print_once("  b/H %.2f, %d rows: M/(P H) %.5f, by which b/H is %.5f; wrinkled %.5f\n", b, rows, found.moment,
                 expected, found.wrinkled);
      EXPECT_NEAR(found.wrinkled, expected, 0.75 / rows);
      EXPECT_NEAR(expected, b, rows < 32 ? 0.02 : 0.005);
    }
  }
}

}  // namespace
}  // namespace pellicle::tension_field_cases_test
