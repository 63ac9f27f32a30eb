#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "base/error.h"
#include "geometry/principal_axes.h"
#include "projection/successive_projection.h"
#include "tests/projection/sheets.h"

namespace pellicle {
namespace {

/// The points of n equal sectors round a common one, which has number 0, spanned by neighbouring spokes of length 1.
class Sectors {
 public:
  Sectors(int n, int parts) : n_(n), parts_(parts) { at(0, 0, 0); }

  /// Number of the point i parts along the spoke where a sector begins and j parts along the next one.
  int at(int sector, int i, int j) {
    const int begin = j == 0 ? sector : i == 0 ? sector + 1 : sector;
    const std::array<int, 3> key{i == 0 && j == 0 ? 0 : begin % n_, i == 0 ? j : i, i == 0 ? 0 : j};
    const auto [entry, is_new] = number_.try_emplace(key, static_cast<int>(points.size()));
    if (is_new) {
      const double a = 2 * M_PI * sector / n_;
      const double b = 2 * M_PI * (sector + 1) / n_;
      points.emplace_back((i * std::cos(a) + j * std::cos(b)) / parts_, (i * std::sin(a) + j * std::sin(b)) / parts_,
                          0);
    }
    return entry->second;
  }

  std::vector<Eigen::Vector3d> points;

 private:
  int n_;
  int parts_;
  std::map<std::array<int, 3>, int> number_;
};

/// n rhombs round vertex 0, each cut into parts x parts.
SurfaceMesh star_mesh(int n, int parts) {
  Sectors sectors(n, parts);
  SurfaceMesh mesh;
  for (int s = 0; s < n; ++s) {
    for (int i = 0; i < parts; ++i) {
      for (int j = 0; j < parts; ++j) {
        mesh.faces.push_back(
            {sectors.at(s, i, j), sectors.at(s, i + 1, j), sectors.at(s, i + 1, j + 1), sectors.at(s, i, j + 1)});
      }
    }
  }
  mesh.points = sectors.points;
  return mesh;
}

/// A quad for every inner edge of a triangle mesh: with the middles of its two triangles. One family of the yellow
/// springs is the net of the inner edges; vertex 0 stays.
SurfaceMesh quads_of_edges(const std::vector<Eigen::Vector3d>& points,
                           const std::vector<std::array<int, 3>>& triangles) {
  std::map<std::array<int, 2>, std::size_t> triangle_left_of;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      triangle_left_of[{triangles[t][k], triangles[t][(k + 1) % 3]}] = t;
    }
  }
  SurfaceMesh mesh;
  std::map<int, int> number;  // Points of the rim may have no quad: new numbers, in the order of use.
  const auto use = [&](int key, const Eigen::Vector3d& point) {
    const auto [entry, is_new] = number.try_emplace(key, static_cast<int>(mesh.points.size()));
    if (is_new) {
      mesh.points.push_back(point);
    }
    return entry->second;
  };
  const auto corner = [&](int point) { return use(point, points[point]); };
  const auto middle = [&](std::size_t t) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int point : triangles[t]) {
      sum += points[point];
    }
    return use(-1 - static_cast<int>(t), sum / 3);
  };
  corner(0);
  for (const auto& [edge, left] : triangle_left_of) {
    const auto right = triangle_left_of.find({edge[1], edge[0]});
    if (edge[0] < edge[1] && right != triangle_left_of.end()) {
      mesh.faces.push_back({corner(edge[0]), middle(right->second), corner(edge[1]), middle(left)});
    }
  }
  return mesh;
}

/// Quads of the edges of n triangles round vertex 0, each cut into parts^2: yellow springs join six neighbours
/// everywhere, n in the middle.
SurfaceMesh wheel_mesh(int n, int parts) {
  Sectors sectors(n, parts);
  std::vector<std::array<int, 3>> triangles;
  for (int s = 0; s < n; ++s) {
    for (int i = 0; i < parts; ++i) {
      for (int j = 0; i + j < parts; ++j) {
        triangles.push_back({sectors.at(s, i, j), sectors.at(s, i + 1, j), sectors.at(s, i, j + 1)});
        if (i + j < parts - 1) {
          triangles.push_back({sectors.at(s, i + 1, j), sectors.at(s, i + 1, j + 1), sectors.at(s, i, j + 1)});
        }
      }
    }
  }
  return quads_of_edges(sectors.points, triangles);
}

/// Quads of the edges of a torus of triangles, six round every vertex.
SurfaceMesh round_torus(int around, int across) {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> triangles;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double a = 2 * M_PI * i / around;
      const double b = 2 * M_PI * j / across;
      const double r = 0.7 + 0.3 * std::cos(b);
      points.emplace_back(r * std::cos(a), r * std::sin(a), 0.3 * std::sin(b));
      const auto at = [&](int di, int dj) { return (i + di) % around * across + (j + dj) % across; };
      triangles.push_back({at(0, 0), at(1, 0), at(1, 1)});
      triangles.push_back({at(0, 0), at(1, 1), at(0, 1)});
    }
  }
  return quads_of_edges(points, triangles);
}

Sheet sheet_of(MPI_Comm comm, const SurfaceMesh& mesh, double thickness) {
  SheetOptions options;
  options.thickness = thickness;
  return make_sheet(comm, mesh, options);
}

std::string message(const SurfaceMesh& mesh, double shift) {
  ProjectOptions options;
  options.shift = shift;
  try {
    require_shift_at_irregular_vertices(sheet_of(PETSC_COMM_WORLD, mesh, 0.01), options);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

TEST(IrregularVertices, MoreThanSixNeighboursNeedAShift) {
  for (const int n : {3, 4, 5, 6}) {
    EXPECT_EQ(message(star_mesh(n, 3), 0), "");
    EXPECT_EQ(message(wheel_mesh(n, 3), 0), "");
  }
  for (const auto& make : {star_mesh, wheel_mesh}) {
    EXPECT_EQ(message(make(7, 3), 0),
              "project.shift: 0, expected at least 0.001 as vertex 0 has 7 neighbours by springs of one colour: beyond "
              "six the projection diverges without it");
    EXPECT_NE(message(make(12, 3), 1e-4).find("project.shift: 0.0001, expected at least 0.001 as vertex 0 has 12"),
              std::string::npos);
    EXPECT_EQ(message(make(12, 3), 1e-3), "");
    EXPECT_EQ(message(make(12, 3), ProjectOptions{}.shift), "");
  }
}

TEST(IrregularVertices, AProjectionRefusesThemOnAllRanks) {
  const Sheet sheet = sheet_of(PETSC_COMM_WORLD, star_mesh(8, 2), 0.01);
  EXPECT_THROW(SuccessiveProjection(sheet, tight_options()), Error);
  ProjectOptions options;
  EXPECT_NO_THROW(SuccessiveProjection(sheet, options));
}

/// Least over largest eigenvalue of the flat sheet's J J^T of one colour, without a shift.
double condition(const SurfaceMesh& mesh, Colour colour) {
  const Sheet sheet = sheet_of(PETSC_COMM_SELF, mesh, 0);
  const SpringSet& springs = sheet.of(colour);
  Linearisation constraint;
  linearise(springs, sheet.rest.data(), springs.initial_length, all_of(springs), constraint);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(springs.local(), 3 * sheet.particles.local());
  for (PetscInt s = 0; s < springs.local(); ++s) {
    const auto& [a, b] = springs.ends[s];
    jacobian.block<1, 3>(s, 3 * a) = constraint.gradient.col(s).transpose();
    jacobian.block<1, 3>(s, 3 * b) = -constraint.gradient.col(s).transpose();
  }
  const Eigen::VectorXd values = principal_axes(jacobian * jacobian.transpose()).values;
  return values.minCoeff() / values.maxCoeff();
}

// Not many neighbours make a net singular, but triangles of springs, which yellow ones may form: also where no vertex
// has more than six neighbours.
TEST(IrregularVertices, ConstraintsAreDependentWhereSpringsFormTriangles) {
  for (const int n : {3, 5, 6, 7, 12}) {
    for (const Colour colour : all_colours) {
      EXPECT_GT(condition(star_mesh(n, 3), colour), 5e-4) << n;
    }
    EXPECT_LT(condition(wheel_mesh(n, 3), Colour::yellow), 1e-12) << n;
    EXPECT_GT(condition(wheel_mesh(n, 3), Colour::blue), 5e-4) << n;
    EXPECT_GT(condition(wheel_mesh(n, 3), Colour::green), 2e-3) << n;
  }
}

// As many yellow springs of one family as its particles have coordinates, and six ways to move as a whole: without a
// shift there is no solution.
TEST(IrregularVertices, AShiftCuresDependentConstraints) {
  for (const double shift : {0.0, 1e-3, ProjectOptions{}.shift}) {
    Scene scene(sheet_of(PETSC_COMM_WORLD, round_torus(24, 12), 0.02));
    SheetOptions noise;
    noise.perturbation = 0.01;
    scene.x.values() = perturbed_positions(scene.sheet, noise);
    ProjectOptions options;
    options.shift = shift;
    SuccessiveProjection projection(scene.sheet, options);
    const double before = projection.errors(scene.x, scene.input()).total;
    const StageResult result = projection.advance(scene.x, scene.input());
    EXPECT_EQ(result.converged, shift > 0) << shift;
    if (shift > 0) {
      EXPECT_LT(result.error, 0.1 * before);
    } else {
      EXPECT_NE(result.reason.find("project_yellow_"), std::string::npos) << result.reason;
    }
  }
}

/// The blue net shrinks by a twentieth in 20 steps under the green one, as a sheet whose corners burn does; on each
/// rank alone.
struct Shrinking {
  double largest_strain = 0;  ///< ||C|| / ||l|| at the end of a step
  double largest_move = 0;    ///< of a particle in a step, in cells
};

Shrinking shrink(const SurfaceMesh& mesh, double cell, double shift) {
  Scene scene(sheet_of(PETSC_COMM_SELF, mesh, cell / 4));
  SheetOptions noise;
  noise.perturbation = 0.01;
  scene.x.values() = perturbed_positions(scene.sheet, noise);
  ProjectOptions options;
  options.shift = shift;
  options.max_steps = 3;
  SuccessiveProjection projection(scene.sheet, options);
  double squared_length = 0;
  for (const SpringSet& springs : scene.sheet.springs) {
    for (const double length : springs.initial_length) {
      squared_length += length * length;
    }
  }
  Shrinking result;
  Eigen::MatrixXd velocity = Eigen::MatrixXd::Zero(3, scene.x.values().cols());
  for (int step = 0; step < 20; ++step) {
    scene.scale_targets(Colour::blue, std::pow(0.95, 1.0 / 20));
    const Eigen::MatrixXd before = scene.x.values();
    scene.x.values() += 0.98 * velocity;
    const StageResult projected = projection.advance(scene.x, scene.input());
    EXPECT_TRUE(projected.converged) << projected.reason;
    velocity = scene.x.values() - before;
    result.largest_move = std::max(result.largest_move, velocity.colwise().norm().maxCoeff() / cell);
    result.largest_strain = std::max(result.largest_strain, projected.error / std::sqrt(squared_length));
  }
  return result;
}

TEST(IrregularVertices, SheetsOfAnyValenceShrinkWithAShift) {
  for (const double shift : {ProjectOptions{}.shift, 1e-3}) {
    for (const int n : {5, 12}) {
      const Shrinking star = shrink(star_mesh(n, 3), 1.0 / 3, shift);
      const Shrinking wheel = shrink(wheel_mesh(n, 3), 0.6 / 3, shift);
      for (const Shrinking& result : {star, wheel}) {
        EXPECT_LT(result.largest_strain, 0.2) << n << " neighbours, shift " << shift;
        EXPECT_LT(result.largest_move, 2) << n << " neighbours, shift " << shift;
      }
    }
  }
}

}  // namespace
}  // namespace pellicle
