// A product with the matrix-free tangent of an elastic sheet, the main part of an iteration of its linear solver, on
// one rank:
//
//     build/release/tests/benchmark_pellicle --benchmark_filter=elastic/product
//
// `times_triad` is the ratio of its shortest time to that of the least bytes that it must read and write, at the
// bandwidth that a = b + s c reaches on as many bytes. Least bytes: of a spring with stiffness its two ends, a vector
// and a number (40), of two particles that bending couples a column and a number (12), of a particle its inertia, with
// an offset and a column (16), argument and result (48). Both in wall time, so that other work slows both alike.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/error.h"
#include "elastic/bending_potential.h"
#include "elastic/mass_part.h"
#include "elastic/spring_potential.h"
#include "energies/tangent.h"
#include "meshing/generators.h"
#include "surface/shell.h"
#include "tests/benchmark/triad.h"
#include "tests/support/undeformed_springs.h"

namespace pellicle {
namespace {

Sheet square_sheet(int cells_a_side) {
  SheetOptions options;
  options.is_one_surface = true;
  return make_sheet(PETSC_COMM_SELF, rectangle_mesh({cells_a_side, cells_a_side}, {1, 1}), options);
}

void elastic_product(benchmark::State& state, int cells_a_side) {
  const Sheet sheet = square_sheet(cells_a_side);
  const auto particles = static_cast<std::size_t>(sheet.particles.local());
  const Stiffness stiffness = stiffness_of({});
  const ActiveSet active(sheet);
  const std::vector<double> ones(particles, 1.0);
  SheetSprings material(sheet, stiffness, Eigen::Vector3d::UnitX(), {});
  SpringPotential springs(sheet);
  springs.set(undeformed_springs(sheet, material.stiffness(active)));
  Field positions(sheet.particles, 3);
  positions.values() = sheet.rest;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    positions.vector(i).z() += 0.02 * std::sin(30 * sheet.rest(0, i)) * std::cos(20 * sheet.rest(1, i));
  }
  BendingPotential bending(sheet, Eigen::Vector3d::UnitX(), std::vector<bool>(particles, false));
  bending.begin_step(active, positions, {ones, 0, stiffness.bending, ones, 0});
  Inertia inertia(sheet.particles);
  const auto mass = [](std::size_t) { return 1; };
  inertia.set(positions, mass, 1);
  Tangent tangent(sheet.particles, {&springs, &bending, &inertia}, Projectors(particles), TangentMatrix::shell, "");
  tangent.update(positions, Curvature::psd);
  std::ptrdiff_t with_stiffness = 0;
  for (const std::vector<double>& of_colour : material.stiffness(active)) {
    with_stiffness += std::count_if(of_colour.begin(), of_colour.end(), [](double k) { return k > 0; });
  }
  const double bytes = 40.0 * static_cast<double>(with_stiffness) +
                       6.0 * static_cast<double>(bending.pattern().size()) + 64.0 * static_cast<double>(particles);
  time_products(state, tangent.matrix(), bytes);
}

[[maybe_unused]] const bool elastic_registered = [] {
  for (const int cells_a_side : {32, 100, 316}) {
    const std::string springs = std::to_string(10 * cells_a_side * cells_a_side);
    benchmark::RegisterBenchmark(("elastic/product/" + springs).c_str(), elastic_product, cells_a_side)
        ->Unit(benchmark::kMillisecond);
  }
  return true;
}();

}  // namespace
}  // namespace pellicle
