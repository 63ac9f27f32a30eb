// A strip whose strength scatters is as strong on any mesh.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "ablation/cracks.h"
#include "parallel/collective.h"
#include "surface/membrane.h"
#include "tests/ablation/sheets.h"

namespace pellicle::scatter_test {
namespace {

constexpr double length = 0.2;  // [m]
constexpr double width = 0.01;  // [m]
constexpr double scatter = 0.5;
constexpr int seeds = 24;

struct Cells {
  int along;
  int across;
};

SurfaceMesh strip_mesh(const Cells& cells, bool is_of_triangles) {
  SurfaceMesh mesh = grid_mesh(cells.along, cells.across, length / cells.along);
  for (Eigen::Vector3d& point : mesh.points) {
    point.y() *= width / cells.across * cells.along / length;
  }
  if (is_of_triangles) {
    const SurfaceMesh quads = mesh;
    mesh.faces.clear();
    mesh.uv.clear();
    for (std::size_t q = 0; q < quads.faces.size(); ++q) {
      const auto& face = quads.faces[q];
      if (q % 2 == 0) {
        mesh.faces.push_back({face[0], face[1], face[2]});
        mesh.faces.push_back({face[0], face[2], face[3]});
      } else {
        mesh.faces.push_back({face[0], face[1], face[3]});
        mesh.faces.push_back({face[1], face[2], face[3]});
      }
    }
  }
  return mesh;
}

/// The stress along x at which each seed's strip cracks first, over the strength. Collective.
std::vector<double> strengths(const Surface& surface) {
  const ActiveSet active(surface);
  Field position(surface.particles, 3);
  position.values() = surface.rest;
  Field mass(surface.particles, 1);
  std::copy(surface.initial_mass.begin(), surface.initial_mass.end(), mass.data());
  const std::vector<bool> pinned(surface.initial_mass.size(), false);
  std::vector<double> result;
  for (int seed = 1; seed <= seeds; ++seed) {
    AblationOptions options;
    options.strength = 1;
    options.strength_length = 0;
    options.strength_scatter = scatter;
    options.seed = seed;
    Cracks cracks(surface, options, {});
    double below = 1 - scatter;
    double above = 1 + scatter;
    while (above - below > 1e-3) {
      const double middle = (below + above) / 2;
      const Eigen::Matrix3d along = middle * Eigen::Vector3d::UnitX() * Eigen::RowVector3d::UnitX();
      const std::vector<Eigen::Matrix3d> stress(surface.element_mass.size(), along);
      const std::vector<PetscInt> sides = cracks.sides({active, stress, position, mass, pinned, 0.5});
      (on_any_rank(surface.comm(), !sides.empty()) ? above : below) = middle;
    }
    result.push_back(above);
  }
  return result;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) {
    sum += value;
  }
  return sum / static_cast<double>(values.size());
}

double deviation(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) {
    sum += std::pow(value - mean(values), 2);
  }
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

/// Each seed's strip is nearly the same on each mesh, so that means and deviations differ less than by the sample.
void expect_same(const std::vector<double>& found, const std::vector<double>& fine, const std::string& mesh) {
  EXPECT_NEAR(mean(found), mean(fine), 0.02) << mesh;
  EXPECT_NEAR(deviation(found), deviation(fine), 0.02) << mesh;
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_NEAR(found[k], fine[k], 0.08) << mesh << ", seed " << k + 1;
  }
}

Membrane wall(const Cells& cells) {
  Membrane membrane = make_membrane(PETSC_COMM_WORLD, strip_mesh(cells, true), {});
  set_burnable(membrane, std::vector<double>(membrane.triangles.size(), 1.0));
  return membrane;
}

TEST(Scatter, IsThatOfTheStripAndNotOfItsCells) {
  const std::vector<double> fine = strengths(shell_of(strip_mesh({40, 8}, false)));
  EXPECT_GT(deviation(fine), 0.03);
  EXPECT_LT(deviation(fine), 0.12);
  EXPECT_LT(mean(fine), 0.65) << "the weakest of some ten places";
  EXPECT_GT(mean(fine), 0.53);
  for (const auto& cells : {Cells{5, 1}, {10, 2}, {20, 4}, {13, 3}}) {
    const std::string name = std::to_string(cells.along) + "x" + std::to_string(cells.across);
    expect_same(strengths(shell_of(strip_mesh(cells, false))), fine, name);
    expect_same(strengths(wall(cells)), fine, name + ", triangles");
  }
}

}  // namespace
}  // namespace pellicle::scatter_test
