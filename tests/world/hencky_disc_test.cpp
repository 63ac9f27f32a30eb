// A flat sheet clamped at its round rim and blown up by pressure: Hencky's problem, the deck `disc`.

#include <array>
#include <cmath>
#include <ostream>

#include "meshing/generators.h"
#include "prism/metric_energy.h"
#include "tests/support/print_once.h"
#include "tests/world/static_balloon.h"

namespace pellicle::hencky_disc_test {
namespace {

constexpr double radius = 0.1;      // a [m]
constexpr double thickness = 1e-4;  // h [m]
constexpr double young = 1e9;       // E [Pa]
/// q a / (E h) = 1e-4: Hencky's load is vertical and his slopes are small. Here the slope at the rim is 0.06, and what
/// its square changes is a few thousandths.
constexpr double load = 100;  // q [Pa]

Options disc_options(double poisson) {
  Options options = static_plate_options(young, poisson, thickness);
  options.prism.mass_damping = 1000;  // with steps of 5 ms: leads from the flat sheet to rest
  options.pins["rim"].group = "rim";
  options.chambers["below"].law = "pressure";
  options.chambers["below"].pressure = {{0, load}};
  return options;
}

/// What is known of a disc at rest.
struct Disc {
  double deflection = 0;  ///< of the centre [m]
  double at_centre = 0;   ///< largest principal stress times thickness: mean of the elements round the centre [N/m]
  double at_rim = 0;      ///< radial, from the means over the two outer rings of elements [N/m]
  double movement = 0;    ///< of the centre in the last step [m]
};

Disc inflated_disc(int rings, double poisson) {
  StaticBalloon disc(disc_mesh(rings, radius), disc_options(poisson));
  constexpr PetscInt centre = 0;
  const Membrane& membrane = disc.membrane();
  Disc result;
  for (int step = 1; step <= 20; ++step) {
    result.movement = -disc.height_of(centre);
    disc.reach(5e-3 * step);
    result.deflection = disc.height_of(centre);
    result.movement += result.deflection;
  }
  print_once("  %d rings: %d Newton and %d linear iterations\n", rings, disc.newton_iterations, disc.linear_iterations);

  // Rings of elements: the triangles between ring k - 1 and ring k of points, 6 (2 k - 1) of them.
  enum Sum { inner, outer_but_one, outer, count };
  std::array<double, count> sums{};
  std::array<double, count> numbers{};
  const Wall& wall = disc.elements().wall();
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    const auto& [a, b, c] = membrane.triangles[e];
    const auto x = [&](PetscInt i) { return disc.state().position.vector(i); };
    const PrincipalState principal =
        principal_state(wall.materials[0], wall.rule, wall.rest[e], x(b) - x(a), x(c) - x(a), 1);
    const double ring =
        rings * (membrane.rest.col(a) + membrane.rest.col(b) + membrane.rest.col(c)).norm() / (3 * radius);
    const auto add = [&](Sum sum) {
      sums[sum] += principal.stress[0] * thickness;
      numbers[sum] += 1;
    };
    (ring > rings - 0.9 ? add(outer) : ring > rings - 1.9 ? add(outer_but_one) : ring < 1 ? add(inner) : void());
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), count, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  MPI_Allreduce(MPI_IN_PLACE, numbers.data(), count, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_EQ(numbers[inner], 6);
  EXPECT_EQ(numbers[outer], 6 * (2 * rings - 1));
  result.at_centre = sums[inner] / numbers[inner];
  const double last = sums[outer] / numbers[outer];
  result.at_rim = last + (last - sums[outer_but_one] / numbers[outer_but_one]) / 2;
  return result;
}

struct Theory {
  double poisson;
  double deflection;  ///< W of w = a W (q a / (E h))^(1/3)
  double at_centre;   ///< k of a stress resultant k (q^2 a^2 E h)^(1/3)
  double at_rim;
  friend std::ostream& operator<<(std::ostream& stream, const Theory& theory) { return stream << theory.poisson; }
};

class HenckyDisc : public ::testing::TestWithParam<Theory> {};
INSTANTIATE_TEST_SUITE_P(PoissonsRatios, HenckyDisc,
                         ::testing::Values(Theory{0.3, 0.65344, 0.43110, 0.33296},
                                           Theory{0.34, 0.64300, 0.43597, 0.34059},
                                           Theory{0.4, 0.62626, 0.44422, 0.35323}));

TEST_P(HenckyDisc, DeflectionAndStressAreTheTheorys) {
  const Theory& theory = GetParam();
  const Disc disc = inflated_disc(20, theory.poisson);
  const double resultant = std::cbrt(load * load * radius * radius * young * thickness);
  const double deflection = disc.deflection / (radius * std::cbrt(load * radius / (young * thickness)));
  print_once("nu %g: W %.5f (%.5f), k centre %.5f (%.5f), rim %.5f (%.5f)\n", theory.poisson, deflection,
             theory.deflection, disc.at_centre / resultant, theory.at_centre, disc.at_rim / resultant, theory.at_rim);
  EXPECT_LT(std::abs(disc.movement), 1e-6 * disc.deflection) << "not at rest";
  EXPECT_NEAR(deflection, theory.deflection, 0.005 * theory.deflection);
  EXPECT_NEAR(disc.at_centre / resultant, theory.at_centre, 0.005 * theory.at_centre);
  EXPECT_NEAR(disc.at_rim / resultant, theory.at_rim, 0.005 * theory.at_rim);
}

}  // namespace
}  // namespace pellicle::hencky_disc_test
