// Heat on membranes: the same operators and stages as on sheets, on the triangles of the mesh.

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "heat/conduction.h"
#include "heat/heat_balance.h"
#include "meshing/closed_shapes.h"
#include "meshing/triangulation.h"
#include "parallel/collective.h"
#include "tests/heat/sheets.h"

namespace pellicle {
namespace {

std::vector<double> constant(const Membrane& membrane, double value) {
  return std::vector<double>(static_cast<std::size_t>(membrane.particles.local()), value);
}

DiffusionGraph cotangent(const Membrane& membrane, const Field& positions) {
  DiffusionGraph graph;
  graph.pairs = cotangent_pairs(membrane);
  set_cotangent(graph, membrane, constant(membrane, 1), positions, initial_masses(membrane), ActiveSet(membrane));
  return graph;
}

// cos(k x) on an insulated unit square decays with alpha k^2.
TEST(HeatOfAMembrane, AModeDecaysAsItShould) {
  const double k = M_PI;
  std::vector<double> errors;
  for (const int n : {8, 16, 32}) {
    const Membrane membrane = membrane_of(triangulated(grid_mesh(n, n, 1.0 / n)));
    HeatOptions options;
    options.diffusivity = 0.3;
    options.ksp_rtol = 1e-12;
    Conduction conduction(membrane, options, {});
    Field temperature = field_of(membrane, [&](const Eigen::Vector3d& x) { return 400 + 100 * std::cos(k * x.x()); });
    const Field mass = initial_masses(membrane);
    const double heat = sum_over_ranks(PETSC_COMM_WORLD, heat_content(membrane, mass, temperature, options.capacity));
    const double step = 0.02;
    const int steps = 5;
    for (int s = 0; s < steps; ++s) {
      ASSERT_TRUE(
          conduction.advance(temperature, {rest_positions(membrane), mass, ActiveSet(membrane), step}).converged);
    }
    EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, heat_content(membrane, mass, temperature, options.capacity)), heat,
                1e-14 * heat);
    const double amplitude = 100 * std::pow(1 + options.diffusivity * step * k * k, -steps);
    double error = 0;  // squared, by mass
    for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
      const double difference = temperature.data()[i] - 400 - amplitude * std::cos(k * membrane.rest(0, i));
      error += mass.data()[i] * difference * difference;
    }
    errors.push_back(std::sqrt(sum_over_ranks(PETSC_COMM_WORLD, error) / test_density));
  }
  EXPECT_LT(errors[2], 0.1);
  EXPECT_GT(errors[0] / errors[1], 3.5);
  EXPECT_GT(errors[1] / errors[2], 3.7);
}

// Rayleigh quotients of spherical harmonics: l (l + 1) / R^2.
TEST(HeatOfAMembrane, EigenvaluesOfASphereConvergeAtSecondOrder) {
  const double radius = 0.5;
  std::vector<double> errors;
  for (const int level : {2, 3, 4}) {
    const Membrane membrane = membrane_of(icosphere_mesh(level, radius));
    const DiffusionGraph graph = cotangent(membrane, rest_positions(membrane));
    const Field field = field_of(membrane, [](const Eigen::Vector3d& x) { return x.x() * x.y(); });
    const Eigen::VectorXd owned = field.values().row(0).head(membrane.particles.owned);
    const double energy = sum_over_ranks(PETSC_COMM_WORLD, -owned.dot(inflow_of(graph, field)));
    const double norm = sum_over_ranks(PETSC_COMM_WORLD, owned.dot(graph.capacity.cwiseProduct(owned)));
    errors.push_back(std::abs(energy / norm * radius * radius / 6 - 1));
  }
  EXPECT_LT(errors[2], 4e-3);
  EXPECT_GT(errors[0] / errors[1], 3.6);
  EXPECT_GT(errors[1] / errors[2], 3.6);
}

// dT_i/dt = alpha 2/E_i sum over the edges at i of (T_j - T_i)/d_ij, E_i = sum d_ij, whatever the ranks.
TEST(HeatOfAMembrane, TheUmbrellaIsItsFormulaOnTheEdges) {
  const SurfaceMesh mesh = triangulated(irregular_mesh(6, 5, 0.1));  // with edges of one triangle and of two
  const auto value = [](const Eigen::Vector3d& x) { return 300 + 100 * x.x() + 200 * x.y() * x.z(); };
  std::set<std::pair<int, int>> edges;
  for (const auto& face : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      edges.insert(std::minmax({face[k], face[(k + 1) % 3]}));
    }
  }
  std::vector<double> length(mesh.points.size(), 0);
  std::vector<double> flow(mesh.points.size(), 0);
  for (const auto& [a, b] : edges) {
    const auto i = static_cast<std::size_t>(a);
    const auto j = static_cast<std::size_t>(b);
    const double d = (mesh.points[i] - mesh.points[j]).norm();
    const double difference = value(mesh.points[j]) - value(mesh.points[i]);
    length[i] += d;
    length[j] += d;
    flow[i] += difference / d;
    flow[j] -= difference / d;
  }
  const Membrane membrane = membrane_of(mesh);
  DiffusionGraph graph;
  graph.pairs = umbrella_pairs(membrane);
  set_umbrella(graph, membrane, constant(membrane, 0.7), rest_positions(membrane), ActiveSet(membrane));
  const Eigen::VectorXd rate = inflow_of(graph, field_of(membrane, value)).cwiseQuotient(graph.capacity);
  for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
    const auto id = static_cast<std::size_t>(membrane.persistent_id[i]);
    EXPECT_NEAR(rate[i], 0.7 * 2 / length[id] * flow[id], 1e-9 * std::abs(rate[i]) + 1e-9);
  }
}

TEST(HeatOfAMembrane, MassAndAreaOfAVertexAreAThirdOfItsElements) {
  const Membrane membrane = membrane_of(triangulated(grid_mesh(7, 5, 0.1)), 0.25);
  const Eigen::VectorXd area = particle_areas(membrane, rest_positions(membrane), ActiveSet(membrane));
  double mass = 0;
  for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
    EXPECT_NEAR(membrane.initial_mass[i], 0.25 * area[i], 1e-17);
    mass += membrane.initial_mass[i];
  }
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, mass), 0.25 * 0.35, 1e-15);
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, area.sum()), 0.35, 1e-15);
}

// What is dead does not conduct: heat stays on its side of a gap.
TEST(HeatOfAMembrane, NothingFlowsThroughWhatIsDead) {
  const Membrane membrane = membrane_of(triangulated(grid_mesh(8, 4, 0.1)));
  ActiveSet active(membrane);
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    double x = 0;
    for (const PetscInt corner : membrane.triangles[e]) {
      x += membrane.rest(0, corner) / 3;
    }
    active.triangles[e] = !(x > 0.4 && x < 0.5);
  }
  HeatOptions options;
  options.diffusivity = 1;
  Conduction conduction(membrane, options, {});
  Field temperature = field_of(membrane, [](const Eigen::Vector3d& x) { return x.x() < 0.45 ? 300.0 : 900.0; });
  for (int step = 0; step < 20; ++step) {
    ASSERT_TRUE(
        conduction.advance(temperature, {rest_positions(membrane), initial_masses(membrane), active, 0.1}).converged);
  }
  for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
    EXPECT_NEAR(temperature.data()[i], membrane.rest(0, i) < 0.45 ? 300 : 900, 1e-9);
  }
}

}  // namespace
}  // namespace pellicle
