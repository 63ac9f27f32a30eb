#include "heat/diffusion_graph.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <fstream>

#include "meshing/readers.h"
#include "parallel/collective.h"
#include "tests/heat/sheets.h"

namespace pellicle {
namespace {

std::vector<double> constant(const Sheet& sheet, double value) {
  return std::vector<double>(static_cast<std::size_t>(sheet.particles.local()), value);
}

DiffusionGraph umbrella(const Sheet& sheet, const Field& positions, double alpha = 1) {
  DiffusionGraph graph;
  graph.pairs = umbrella_pairs(sheet);
  set_umbrella(graph, sheet, constant(sheet, alpha), positions, ActiveSet(sheet));
  return graph;
}

DiffusionGraph cotangent(const Sheet& sheet, const Field& positions, double alpha = 1) {
  DiffusionGraph graph;
  graph.pairs = cotangent_pairs(sheet);
  set_cotangent(graph, sheet, constant(sheet, alpha), positions, initial_masses(sheet), ActiveSet(sheet));
  return graph;
}

/// Whether a particle of a grid has all its neighbours: at least a whole cell away from the boundary.
bool is_inside(const Eigen::Vector3d& x, double width, double height, double edge) {
  const double margin = 0.99 * edge;
  return x.x() > margin && x.y() > margin && x.x() < width - margin && x.y() < height - margin;
}

TEST(Umbrella, IsHalfOfTheLaplacianOnARegularSheet) {
  const double edge = 0.1;
  const Sheet sheet = shell_of(grid_mesh(8, 6, edge), 0);
  const Field values =
      field_of(sheet, [](const Eigen::Vector3d& x) { return x.x() * x.x() + 2 * x.y() * x.y() + 3 * x.x() * x.y(); });
  const DiffusionGraph graph = umbrella(sheet, rest_positions(sheet), 0.5);
  const Eigen::VectorXd rate = inflow_of(graph, values).cwiseQuotient(graph.capacity);
  int inside = 0;
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    if (is_inside(sheet.rest.col(i), 0.8, 0.6, edge)) {
      EXPECT_NEAR(rate[i], 0.5 * 0.5 * 6, 1e-11);
      ++inside;
    }
  }
  EXPECT_EQ(sum_over_ranks(PETSC_COMM_WORLD, inside), 7 * 5 + 6 * 4);
}

TEST(Cotangent, IsTheLaplacianOnARegularSheetOfAnyThickness) {
  const double edge = 0.1;
  const Sheet sheet = shell_of(grid_mesh(8, 6, edge), 0.07);
  const Field values =
      field_of(sheet, [](const Eigen::Vector3d& x) { return x.x() * x.x() + 2 * x.y() * x.y() + 3 * x.x() * x.y(); });
  const DiffusionGraph graph = cotangent(sheet, rest_positions(sheet), 0.5);
  const Eigen::VectorXd rate = inflow_of(graph, values).cwiseQuotient(graph.capacity);
  int inside = 0;
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    if (is_inside(sheet.rest.col(i), 0.8, 0.6, edge)) {
      EXPECT_NEAR(rate[i], 0.5 * 6, 1e-11);
      ++inside;
    }
  }
  EXPECT_EQ(sum_over_ranks(PETSC_COMM_WORLD, inside), 7 * 5 + 6 * 4);
}

// The patch test of linear finite elements: a linear field flows nowhere, however the triangles are shaped.
TEST(Cotangent, ALinearFieldFlowsNowhereOnAnIrregularFlatMesh) {
  SurfaceMesh mesh = irregular_mesh(9, 7, 0.1);
  for (Eigen::Vector3d& point : mesh.points) {
    point.z() = 0;
  }
  const Sheet sheet = shell_of(mesh, 0.05);
  const Field values = field_of(sheet, [](const Eigen::Vector3d& x) { return 300 + 200 * x.x() - 100 * x.y(); });
  const Eigen::VectorXd inflow = inflow_of(cotangent(sheet, rest_positions(sheet)), values);
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    if (is_inside(sheet.rest.col(i), 0.9, 0.7, 0.125)) {  // 1.25 cells: no point of the boundary is moved further in.
      EXPECT_NEAR(inflow[i], 0, 1e-12);
    }
  }
}

/// Quads of a sphere: a cube whose faces' grids are spaced by equal angles, thrown on the sphere.
SurfaceMesh cubed_sphere(int n, double radius) {
  SurfaceMesh mesh;
  std::map<std::array<int, 3>, int> numbers;
  const auto number = [&](const std::array<int, 3>& place) {
    const auto [entry, is_new] = numbers.try_emplace(place, static_cast<int>(mesh.points.size()));
    if (is_new) {
      Eigen::Vector3d point;
      for (int k = 0; k < 3; ++k) {
        point[k] = std::tan(M_PI / 4 * (2.0 * place[k] / n - 1));
      }
      mesh.points.emplace_back(radius * point.normalized());
    }
    return entry->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const int side : {0, n}) {
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
          std::vector<int> face;
          for (const auto& [di, dj] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
            std::array<int, 3> place{};
            place[axis] = side;
            place[(axis + 1) % 3] = i + di;
            place[(axis + 2) % 3] = j + dj;
            face.push_back(number(place));
          }
          if (side == 0) {
            std::reverse(face.begin(), face.end());
          }
          mesh.faces.push_back(face);
        }
      }
    }
  }
  return mesh;
}

// Rayleigh quotients of spherical harmonics: l (l + 1) / R^2.
TEST(Cotangent, EigenvaluesOfASphereConvergeAtSecondOrder) {
  const double radius = 0.5;
  struct Harmonic {
    int degree;
    std::function<double(const Eigen::Vector3d&)> value;  // of the direction
  };
  const std::vector<Harmonic> harmonics{{1, [](const Eigen::Vector3d& d) { return d.z(); }},
                                        {1, [](const Eigen::Vector3d& d) { return d.x() + d.y(); }},
                                        {2, [](const Eigen::Vector3d& d) { return d.x() * d.y(); }},
                                        {2, [](const Eigen::Vector3d& d) { return 3 * d.z() * d.z() - 1; }}};
  std::vector<std::vector<double>> errors(harmonics.size());
  for (const int n : {8, 16, 32}) {
    const Sheet sheet = shell_of(cubed_sphere(n, radius), 0.01);
    EXPECT_EQ(sheet.particles.global - sheet.elements.global, 6 * n * n + 2);
    const DiffusionGraph graph = cotangent(sheet, rest_positions(sheet));
    for (std::size_t k = 0; k < harmonics.size(); ++k) {
      const Field field = field_of(sheet, [&](const Eigen::Vector3d& x) { return harmonics[k].value(x.normalized()); });
      const Eigen::VectorXd owned = field.values().row(0).head(sheet.particles.owned);
      const double energy = sum_over_ranks(PETSC_COMM_WORLD, -owned.dot(inflow_of(graph, field)));
      const double norm = sum_over_ranks(PETSC_COMM_WORLD, owned.dot(graph.capacity.cwiseProduct(owned)));
      const int l = harmonics[k].degree;
      errors[k].push_back(std::abs(energy / norm * radius * radius / (l * (l + 1)) - 1));
    }
  }
  for (const std::vector<double>& error : errors) {
    EXPECT_LT(error[2], 4e-3);
    EXPECT_GT(error[0] / error[1], 3.6);
    EXPECT_GT(error[1] / error[2], 3.8);
  }
}

TEST(DiffusionGraph, EveryOperatorIsSymmetricAndKeepsAUniformField) {
  const Sheet sheet = shell_of(irregular_mesh(7, 6, 0.1), 0.03);
  const Field positions = rest_positions(sheet);
  std::vector<double> alpha;
  for (const PetscInt id : sheet.persistent_id) {
    alpha.push_back(1 + 0.8 * std::sin(id));
  }
  DiffusionGraph first{umbrella_pairs(sheet), {}, {}};
  set_umbrella(first, sheet, alpha, positions, ActiveSet(sheet));
  DiffusionGraph second{cotangent_pairs(sheet), {}, {}};
  set_cotangent(second, sheet, alpha, positions, initial_masses(sheet), ActiveSet(sheet));

  const Field a = field_of(sheet, [](const Eigen::Vector3d& x) { return std::sin(30 * x.x() + 50 * x.y()); });
  const Field b = field_of(sheet, [](const Eigen::Vector3d& x) { return std::cos(70 * x.x() - 20 * x.y()); });
  const Field uniform = field_of(sheet, [](const Eigen::Vector3d&) { return 412.7; });
  const PetscInt owned = sheet.particles.owned;
  for (const DiffusionGraph& graph : {first, second}) {
    EXPECT_EQ(inflow_of(graph, uniform).cwiseAbs().sum(), 0);
    const double ab = sum_over_ranks(PETSC_COMM_WORLD, a.values().row(0).head(owned).dot(inflow_of(graph, b)));
    const double ba = sum_over_ranks(PETSC_COMM_WORLD, b.values().row(0).head(owned).dot(inflow_of(graph, a)));
    const double aa = sum_over_ranks(PETSC_COMM_WORLD, a.values().row(0).head(owned).dot(inflow_of(graph, a)));
    EXPECT_NEAR(ab, ba, 1e-12 * std::abs(aa));
    EXPECT_LT(aa, 0);
    EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, inflow_of(graph, a).sum()), 0, 1e-12 * std::abs(aa));
  }
}

TEST(DiffusionGraph, ACollapsedSheetHasFiniteWeights) {
  const Sheet sheet = shell_of(grid_mesh(3, 3, 0.1), 0.03);
  const Field nowhere(sheet.particles, 3);
  const DiffusionGraph of_springs = umbrella(sheet, nowhere);
  for (std::size_t p = 0; p < of_springs.pairs.size(); ++p) {
    const auto [a, b] = of_springs.pairs[p];
    EXPECT_NEAR(of_springs.weights[p] * 1e-3 * (sheet.rest.col(a) - sheet.rest.col(b)).norm(), 1, 1e-12);
  }
  for (const double weight : cotangent(sheet, nowhere).weights) {
    EXPECT_EQ(weight, 0);
  }
}

TEST(Umbrella, MatchesTheReference) {
  const std::string name = shared_folder() + "/reference/A1_burn";
  if (!std::ifstream(name + ".obj")) {
    GTEST_SKIP() << "no reference cases in " << shared_folder();
  }
  const YAML::Node given = YAML::LoadFile(name + ".params.json");
  const YAML::Node expected = YAML::LoadFile(name + ".expected.json");
  const Sheet sheet = shell_of(read_mesh(name + ".obj"), given["thickness"].as<double>());
  const auto x0 = given["x0"].as<std::vector<std::vector<double>>>();
  const auto t0 = given["T0"].as<std::vector<double>>();
  const auto weights = expected["umbrella_E"].as<std::vector<double>>();
  const auto laplacian = expected["umbrella_L_of_T2"].as<std::vector<double>>();
  Field positions(sheet.particles, 3);
  Field squares(sheet.particles, 1);
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const auto id = static_cast<std::size_t>(sheet.persistent_id[i]);
    positions.vector(i) = Eigen::Map<const Eigen::Vector3d>(x0[id].data());
    squares.data()[i] = t0[id] * t0[id] / 1e6;
  }
  const DiffusionGraph graph = umbrella(sheet, positions);
  const Eigen::VectorXd result = inflow_of(graph, squares).cwiseQuotient(graph.capacity);
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    const auto id = static_cast<std::size_t>(sheet.persistent_id[i]);
    EXPECT_NEAR(2 * graph.capacity[i], weights[id], 1e-12);
    EXPECT_NEAR(result[i], laplacian[id], 1e-11);
  }
}

}  // namespace
}  // namespace pellicle
