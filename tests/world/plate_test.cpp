// Walls that bend as plates do: a clamped disc under pressure, a strip that buckles.

#include <cmath>
#include <string>
#include <vector>

#include "meshing/generators.h"
#include "meshing/triangulation.h"
#include "tests/support/print_once.h"
#include "tests/support/shaken_mesh.h"
#include "tests/support/solver_options.h"
#include "tests/world/static_balloon.h"

namespace pellicle::plate_test {
namespace {

constexpr double young = 1e9;       // E [Pa]
constexpr double thickness = 1e-3;  // h [m]

double rigidity(double poisson) { return young * std::pow(thickness, 3) / (12 * (1 - poisson * poisson)); }

Options plate_options(double poisson) { return static_plate_options(young, poisson, thickness); }

/// Plates are too badly conditioned for anything but factors.
void solve_directly(SolverOptions& options) {
  options.set("prism_ksp_type", "preonly");
  options.set("prism_pc_type", "cholesky");
  options.set("prism_pc_factor_mat_solver_type", "mumps");
}

constexpr double radius = 0.1;  // a [m]

/// Of the centre, over q a^4 / (64 D).
double deflection(const SurfaceMesh& mesh, double poisson) {
  Options options = plate_options(poisson);
  const double small = 1e-3 * thickness;
  const double pressure = small * 64 * rigidity(poisson) / std::pow(radius, 4);
  options.prism.mat_type = "aij";
  options.pins["rim"].group = "rim";
  options.pins["rim"].clamped = true;
  options.chambers["below"].law = "pressure";
  options.chambers["below"].pressure = {{0, pressure}};
  StaticBalloon plate(mesh, options);
  plate.reach(1);
  return plate.height_of(0) / small;
}

TEST(Plate, AClampedDiscSinksByItsLoadOver64TimesItsRigidity) {
  SolverOptions solver;
  solve_directly(solver);
  for (const double poisson : {0.0, 0.3, 0.45}) {
    double before = 1;
    for (const int rings : {8, 16, 32}) {
      const double error = deflection(disc_mesh(rings, radius), poisson) - 1;
      print_once("  nu %.2f, %2d rings: %+.4f\n", poisson, rings, error);
      EXPECT_LT(std::abs(error), 0.4 * std::abs(before)) << "of second order";
      before = error;
    }
    EXPECT_LT(std::abs(before), 0.004) << poisson;
  }
}

TEST(Plate, SoItDoesOnIrregularMeshes) {
  SolverOptions solver;
  solve_directly(solver);
  for (const int rings : {8, 16, 32}) {
    for (const double fraction : {0.2, 0.3}) {
      const double error = deflection(shaken(disc_mesh(rings, radius), fraction * radius / rings, "rim"), 0.3) - 1;
      print_once("  shaken by %.1f, %2d rings: %+.4f\n", fraction, rings, error);
      if (rings == 32) {
        EXPECT_LT(std::abs(error), 0.01) << fraction;
      }
    }
  }
}

/// A strip, hinged at both ends, is shortened by four times the strain at which it buckles. Without Poisson's ratio it
/// bends to a cylinder, whether its sides are free or not, and carries D pi^2 / L^2 a width from then on: what it is
/// shortened by alone makes that larger by its half.
/// @returns force over that
double buckling_force(const SurfaceMesh& mesh, double length, double width) {
  Options options = plate_options(0);
  const double critical = std::pow(M_PI * thickness / length, 2) / 12;
  options.prism.mat_type = "aij";
  options.prism.mass_damping = 10;
  // Factors do not show that the exact tangent is indefinite, and Newton's method goes to a saddle point, such as two
  // half waves. With `fixed` the elements' compression is left out of it.
  options.prism.newton = "fixed";
  options.prism.max_iterations = 50;
  options.sheet.perturbation = 1e-3;
  options.pins["left"].group = "left";
  options.pins["right"].group = "right";
  options.pins["right"].path = {{0, 0, 0, 0}, {1, -4 * critical * length, 0, 0}};
  StaticBalloon strip(mesh, options);
  strip.reach(2, 10);
  const PetscInt owned = strip.membrane().particles.owned;
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, owned);
  strip.elements().add_gradient(strip.state().position, strip.state().thickness_ratio, gradient);
  double force = 0;
  for (const PetscInt i : strip.membrane().groups.at("left")) {
    force += i < owned ? gradient(0, i) : 0;
  }
  MPI_Allreduce(MPI_IN_PLACE, &force, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  return force / (rigidity(0) * std::pow(M_PI / length, 2) * width);
}

TEST(Plate, AStripBucklesAtEulersLoad) {
  SolverOptions solver;
  solve_directly(solver);
  const double length = 0.1;
  const double width = 0.03;
  for (const bool is_crossed : {false, true}) {
    const SurfaceMesh mesh =
        is_crossed ? square_mesh({20, 6}, {length, width}) : triangulated(rectangle_mesh({20, 6}, {length, width}));
    const double fraction = buckling_force(mesh, length, width);
    print_once("  %.4f of Euler's load\n", fraction);
    EXPECT_NEAR(fraction, 1, 0.005);
  }
}

}  // namespace
}  // namespace pellicle::plate_test
