#include "ablation/stress_average.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "parallel/collective.h"
#include "surface/membrane.h"
#include "tests/ablation/sheets.h"

namespace pellicle::stress_average_test {
namespace {

constexpr double size = 1;  // of the square sheet [m]

/// A square of n x n cells that is slit from the middle of its left side to its centre.
SurfaceMesh slit_mesh(int n) {
  SurfaceMesh mesh = grid_mesh(n, n, size / n);
  std::map<int, int> copy;
  for (int i = 0; i < n / 2; ++i) {
    const int vertex = n / 2 * (n + 1) + i;
    copy[vertex] = static_cast<int>(mesh.points.size());
    mesh.points.push_back(mesh.points[vertex]);
  }
  for (std::size_t face = static_cast<std::size_t>(n * (n / 2)); face < mesh.faces.size(); ++face) {
    for (int& corner : mesh.faces[face]) {
      corner = copy.count(corner) > 0 ? copy.at(corner) : corner;
    }
  }
  return mesh;
}

SurfaceMesh halved(const SurfaceMesh& quads) {
  SurfaceMesh mesh;
  mesh.points = quads.points;
  for (const auto& face : quads.faces) {
    mesh.faces.push_back({face[0], face[1], face[2]});
    mesh.faces.push_back({face[0], face[2], face[3]});
  }
  return mesh;
}

Membrane wall_of(const SurfaceMesh& mesh, MPI_Comm comm = PETSC_COMM_WORLD) {
  Membrane membrane = make_membrane(comm, mesh, {});
  set_burnable(membrane, std::vector<double>(membrane.triangles.size(), 1.0));
  return membrane;
}

Eigen::Vector3d middle(const Surface& surface, std::size_t element) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const int corners = surface.sides_per_element();
  for (int k = 0; k < corners; ++k) {
    sum += surface.rest.col(surface.corner(element, static_cast<std::size_t>(k)));
  }
  return sum / corners;
}

/// The largest principal stress sigma sqrt(2 pi r)/K at the tip of a crack along negative x, as a mean over a square.
double at_a_crack_tip(const Eigen::Vector3d& centre, double edge) {
  constexpr int parts = 8;
  double sum = 0;
  for (int i = 0; i < parts; ++i) {
    for (int j = 0; j < parts; ++j) {
      const double x = centre.x() + edge * ((i + 0.5) / parts - 0.5);
      const double y = centre.y() + edge * ((j + 0.5) / parts - 0.5);
      const double angle = std::atan2(y, x);
      sum += std::cos(angle / 2) * (1 + std::abs(std::sin(angle / 2))) / std::sqrt(std::hypot(x, y));
    }
  }
  return sum / (parts * parts);
}

struct Peak {
  double value;
  Eigen::Vector3d place;  ///< from the tip
};

/// The largest average near the tip of a crack under a stress intensity K = sqrt(2 pi). Collective.
Peak peak(const Surface& surface, int n, double length) {
  const Eigen::Vector3d tip(size / 2, size / 2, 0);
  std::vector<double> tension;
  for (std::size_t e = 0; e < surface.element_mass.size(); ++e) {
    tension.push_back(at_a_crack_tip(middle(surface, e) - tip, size / n));
  }
  StressAverage average(surface, length, "ablation_");
  const std::vector<double> found = average.of(tension, ActiveSet(surface));
  std::vector<std::array<double, 3>> own;
  for (PetscInt e = 0; e < surface.elements.owned; ++e) {
    const Eigen::Vector3d place = middle(surface, e) - tip;
    own.push_back({found[e], place.x(), place.y()});
  }
  const std::vector<std::array<double, 3>> all = of_all_ranks(surface.comm(), own);
  const std::array<double, 3> largest = *std::max_element(all.begin(), all.end());
  return {largest[0], {largest[1], largest[2], 0}};
}

TEST(StressAverage, AtTheTipOfACrackFollowsFromTheStressIntensityOnAnyMesh) {
  for (const double length : {0.03, 0.06}) {
    const double formula = std::sqrt(2 / length);  // K / sqrt(pi l)
    EXPECT_NEAR(peak(shell_of(slit_mesh(48)), 48, length).value, formula, 0.1 * formula) << length;
  }
  constexpr double length = 0.08;
  const double fine = peak(shell_of(slit_mesh(48)), 48, length).value;
  for (const int n : {16, 24, 32}) {
    const double edge = size / n;
    for (const bool is_of_quads : {true, false}) {
      const SurfaceMesh mesh = slit_mesh(n);
      const Peak found = is_of_quads ? peak(shell_of(mesh), n, length) : peak(wall_of(halved(mesh)), n, length);
      EXPECT_NEAR(found.value, fine, 0.1 * fine) << n << (is_of_quads ? " quads" : " triangles");
      EXPECT_LT(found.place.norm(), edge) << "at the tip";
    }
  }
}

TEST(StressAverage, KeepsWhatIsUniformAlsoRoundWhatHasBurnt) {
  const Sheet sheet = shell_of(slit_mesh(12));
  const Membrane wall = wall_of(halved(slit_mesh(12)));
  for (const Surface* surface : {static_cast<const Surface*>(&sheet), static_cast<const Surface*>(&wall)}) {
    ActiveSet active(*surface);
    std::vector<double> tension(surface->element_mass.size(), 3);
    for (std::size_t t = 0; t < active.triangles.size(); ++t) {
      const std::size_t element = t / static_cast<std::size_t>(surface->triangles_per_element);
      active.triangles[t] = surface->element_id[element] % 7 != 0;
      tension[element] = active.triangles[t] ? 3 : 1e6;
    }
    for (const double length : {1e-4, 0.2, 30.0, 1e6}) {
      StressAverage average(*surface, length, "ablation_");
      const std::vector<double> found = average.of(tension, active);
      for (PetscInt e = 0; e < surface->elements.owned; ++e) {
        EXPECT_NEAR(found[e], surface->element_id[e] % 7 == 0 ? 0 : 3, 1e-5) << length;
      }
    }
  }
}

TEST(StressAverage, DoesNotPassThroughACrack) {
  constexpr int n = 32;
  const Sheet sheet = shell_of(slit_mesh(n));
  std::vector<double> tension;
  for (std::size_t e = 0; e < sheet.cells.size(); ++e) {
    tension.push_back(middle(sheet, e).y() < size / 2 ? 1 : 2);
  }
  StressAverage average(sheet, 0.1, "ablation_");
  const std::vector<double> found = average.of(tension, ActiveSet(sheet));
  for (PetscInt e = 0; e < sheet.elements.owned; ++e) {
    const Eigen::Vector3d place = middle(sheet, e);
    if (place.x() < 0.1) {  // four lengths from the tip
      EXPECT_NEAR(found[e], tension[e], 0.02);
    } else if (place.x() > 0.9 && std::abs(place.y() - size / 2) < size / n) {
      EXPECT_NEAR(found[e], 5 / 3.0, 0.1) << "<s^2> / <s> where they are as much of each";
    }
  }
}

TEST(StressAverage, DoesNotDependOnTheRanks) {
  const auto by_id = [](MPI_Comm comm) {
    const Membrane wall = wall_of(halved(irregular_mesh(10, 10, 0.1)), comm);
    std::vector<double> tension;
    for (const PetscInt id : wall.element_id) {
      tension.push_back(1 + std::sin(static_cast<double>(id)));
    }
    StressAverage average(wall, 0.25, "ablation_");
    const std::vector<double> found = average.of(tension, ActiveSet(wall));
    std::map<PetscInt, double> result;
    for (std::size_t e = 0; e < found.size(); ++e) {
      result[wall.element_id[e]] = found[e];
    }
    return result;
  };
  const std::map<PetscInt, double> whole = by_id(PETSC_COMM_SELF);
  for (const auto& [id, value] : by_id(PETSC_COMM_WORLD)) {
    EXPECT_NEAR(value, whole.at(id), 1e-6 * whole.at(id)) << "also of elements of other ranks";
  }
}

}  // namespace
}  // namespace pellicle::stress_average_test
