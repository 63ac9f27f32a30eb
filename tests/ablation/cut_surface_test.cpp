#include "ablation/cut_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "ablation/ablation.h"
#include "parallel/collective.h"
#include "tests/ablation/sheets.h"
#include "tests/support/print_once.h"

namespace pellicle {
namespace {

using Ids = std::array<std::int64_t, 3>;
using Place = std::array<double, 3>;

/// A number in [-1, 1] that depends on the id alone.
double noise(PetscInt id, int seed) { return std::sin(12.9898 * id + 78.233 * seed + 0.3 * id * seed); }

/// A sheet's places with noise, so that no three of them make a round number.
Eigen::Matrix3Xd crumpled(const Sheet& sheet) {
  Eigen::Matrix3Xd positions = sheet.rest;
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    for (int d = 0; d < 3; ++d) {
      positions(d, i) += 0.2 * noise(sheet.persistent_id[i], d);
    }
  }
  return positions;
}

Eigen::Vector3d place(const DrawnPoint& point, const Eigen::Matrix3Xd& positions) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    sum += point.weights[k] * positions.col(point.particles[k]);
  }
  return sum;
}

/// What all ranks draw.
struct Gathered {
  struct Point {
    std::int64_t id;
    Place place;
    bool is_owned;
  };
  struct Triangle {
    PetscInt cell;
    Ids points;
    bool operator<(const Triangle& other) const { return std::tie(cell, points) < std::tie(other.cell, other.points); }
    bool operator==(const Triangle& other) const { return cell == other.cell && points == other.points; }
  };

  Gathered(const Sheet& sheet, const DrawnSurface& surface, const Eigen::Matrix3Xd& positions) {
    for (const DrawnPoint& point : surface.points) {
      const Eigen::Vector3d x = place(point, positions);
      points.push_back({point.id, {x.x(), x.y(), x.z()}, point.is_owned});
    }
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      Triangle triangle{};
      triangle.cell = sheet.persistent_id[sheet.lattice[surface.elements[t]]];
      for (std::size_t i = 0; i < 3; ++i) {
        triangle.points[i] = surface.points[surface.triangles[t][i]].id;
      }
      triangles.push_back(triangle);
    }
    if (sheet.comm() != PETSC_COMM_SELF) {
      points = of_all_ranks(PETSC_COMM_WORLD, points);
      triangles = of_all_ranks(PETSC_COMM_WORLD, triangles);
    }
    std::sort(triangles.begin(), triangles.end());
  }

  std::vector<Point> points;
  std::vector<Triangle> triangles;
};

/// Area of what all ranks draw, in the plane of a flat sheet; a triangle that faces down would count negative.
double area(const DrawnSurface& surface, const Eigen::Matrix3Xd& positions) {
  double sum = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const auto at = [&](PetscInt point) { return place(surface.points[point], positions); };
    sum += (at(b) - at(a)).cross(at(c) - at(a)).z() / 2;
  }
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  return sum;
}

/// A level of the place of each particle, that of a lattice particle of its virtual centre: flat sheets in x-y.
template <class Function>
std::vector<double> level_of(const Sheet& sheet, const Function& function) {
  std::vector<double> level;
  for (Eigen::Index i = 0; i < sheet.rest.cols(); ++i) {
    level.push_back(function(sheet.rest(0, i), sheet.rest(1, i)));
  }
  return level;
}

/// Levels without any order, negative at about a third of the particles.
std::vector<double> rough_level(const Sheet& sheet) {
  return level_by_id(sheet, [](PetscInt id) { return 0.4 + noise(id, 7); });
}

std::vector<double> unburnt(const Sheet& sheet) { return std::vector<double>(sheet.persistent_id.size(), 1); }

/// The ids of the particles between which a point lies, in order; one where it is uncut.
std::set<std::int64_t> particles_of(std::int64_t id) {
  if (id >= 0) {
    return {id};
  }
  return {-(id + 1) / cut_id_stride, -(id + 1) % cut_id_stride};
}

TEST(CutSurface, UncutSheetIsFourTrianglesACellRoundItsCentre) {
  const Sheet sheet = shell_of(grid_mesh(7, 5, 1.0));
  const DrawnSurface surface = cut_surface(sheet, ActiveSet(sheet), unburnt(sheet));
  ASSERT_EQ(surface.triangles.size(), 4 * static_cast<std::size_t>(sheet.elements.owned));
  std::vector<PetscInt> corners;  // of the rank's own cells, in the order in which they are first used
  for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
    for (const PetscInt corner : sheet.cells[cell]) {
      if (std::find(corners.begin(), corners.end(), corner) == corners.end()) {
        corners.push_back(corner);
      }
    }
  }
  ASSERT_EQ(surface.points.size(), corners.size() + static_cast<std::size_t>(sheet.elements.owned));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const DrawnPoint& point = surface.points[i];
    EXPECT_EQ(point.particles[0], corners[i]);
    EXPECT_EQ(point.weights, (std::array<double, 4>{1, 0, 0, 0}));
    EXPECT_EQ(point.id, sheet.persistent_id[corners[i]]);
    EXPECT_EQ(point.centre_share, 0);
  }
  for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
    const std::size_t centre = corners.size() + cell;
    const DrawnPoint& point = surface.points[centre];
    EXPECT_EQ(point.particles, sheet.cells[cell]);
    EXPECT_EQ(point.weights, (std::array<double, 4>{0.25, 0.25, 0.25, 0.25}));
    EXPECT_EQ(point.id, sheet.persistent_id[sheet.lattice[cell]]);
    EXPECT_EQ(point.lattice, sheet.lattice[cell]);
    EXPECT_EQ(point.centre_share, 1);
    EXPECT_TRUE(point.is_owned);
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& [a, b, c] = surface.triangles[4 * cell + k];
      EXPECT_EQ(corners[a], sheet.cells[cell][k]);
      EXPECT_EQ(corners[b], sheet.cells[cell][(k + 1) % 4]);
      EXPECT_EQ(c, static_cast<PetscInt>(centre));
      EXPECT_EQ(surface.elements[4 * cell + k], static_cast<PetscInt>(cell));
    }
  }
}

TEST(CutSurface, AllRanksTogetherDrawWhatOneDraws) {
  const SurfaceMesh mesh = grid_mesh(11, 9, 1.0);
  const Sheet sheet = shell_of(mesh);
  const Gathered together(sheet, cut_surface(sheet, ActiveSet(sheet), rough_level(sheet)), crumpled(sheet));
  const Sheet whole = shell_of(mesh, PETSC_COMM_SELF);
  const Gathered alone(whole, cut_surface(whole, ActiveSet(whole), rough_level(whole)), crumpled(whole));
  EXPECT_EQ(together.triangles, alone.triangles);
  std::map<std::int64_t, Place> places;
  for (const Gathered::Point& point : alone.points) {
    EXPECT_TRUE(point.is_owned);
    EXPECT_TRUE(places.emplace(point.id, point.place).second) << "point " << point.id << " comes twice";
  }
  EXPECT_LT(places.begin()->first, 0) << "something is cut";
  std::map<std::int64_t, int> owners;
  for (const Gathered::Point& point : together.points) {
    const auto found = places.find(point.id);
    ASSERT_NE(found, places.end()) << "point " << point.id;
    EXPECT_EQ(point.place, found->second) << "point " << point.id << ": the same on all ranks to the last bit";
    owners[point.id] += point.is_owned ? 1 : 0;
  }
  EXPECT_EQ(owners.size(), places.size());
  for (const auto& [id, count] : owners) {
    EXPECT_EQ(count, 1) << "owners of point " << id;
  }
}

TEST(CutSurface, IsWatertight) {
  const SurfaceMesh mesh = grid_mesh(11, 9, 1.0);
  const Sheet sheet = shell_of(mesh);
  const Gathered drawn(sheet, cut_surface(sheet, ActiveSet(sheet), rough_level(sheet)), crumpled(sheet));
  std::map<std::set<std::int64_t>, int> faces_at;  // each edge of the mesh
  for (const auto& face : mesh.faces) {
    for (std::size_t k = 0; k < 4; ++k) {
      ++faces_at[{face[k], face[(k + 1) % 4]}];
    }
  }
  std::map<std::pair<std::int64_t, std::int64_t>, int> directed;
  for (const Gathered::Triangle& triangle : drawn.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      ++directed[{triangle.points[i], triangle.points[(i + 1) % 3]}];
    }
  }
  int border = 0;
  for (const auto& [edge, count] : directed) {
    ASSERT_EQ(count, 1) << "neighbours run along their edge in opposite directions";
    if (directed.count({edge.second, edge.first}) == 1) {
      continue;
    }
    ++border;
    std::set<std::int64_t> between = particles_of(edge.first);
    between.merge(particles_of(edge.second));
    const auto outline = faces_at.find(between);
    const bool on_outline = outline != faces_at.end() && outline->second == 1;
    const bool cut_through_one_triangle = edge.first < 0 && edge.second < 0 && between.size() == 3;
    EXPECT_TRUE(on_outline || cut_through_one_triangle) << edge.first << " to " << edge.second;
  }
  EXPECT_GT(border, 2 * (11 + 9) / 2);
}

TEST(CutSurface, DeadTrianglesAreNotDrawn) {
  const Sheet sheet = shell_of(grid_mesh(7, 5, 1.0));
  ActiveSet active(sheet);
  for (std::size_t t = 0; t < active.triangles.size(); ++t) {
    active.triangles[t] = id_of_triangle(sheet, t) % 3 != 0;
  }
  const DrawnSurface surface = cut_surface(sheet, active, unburnt(sheet));
  std::set<std::array<PetscInt, 3>> expected;
  for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
    for (std::size_t k = 0; k < 4; ++k) {
      if (id_of_triangle(sheet, 4 * cell + k) % 3 != 0) {
        expected.insert({sheet.cells[cell][k], sheet.cells[cell][(k + 1) % 4], sheet.lattice[cell]});
      }
    }
  }
  std::set<std::array<PetscInt, 3>> drawn;
  for (const auto& triangle : surface.triangles) {
    std::array<PetscInt, 3> particles{};
    for (std::size_t i = 0; i < 3; ++i) {
      const DrawnPoint& point = surface.points[triangle[i]];
      particles[i] = point.centre_share == 1 ? point.lattice : point.particles[0];
    }
    drawn.insert(particles);
  }
  EXPECT_EQ(drawn, expected);
}

// A corner whose owner draws nothing at it is another rank's to count: all but one triangle are gone, in turn.
TEST(CutSurface, PointsAreCountedOnceWhateverIsLeft) {
  const Sheet sheet = shell_of(grid_mesh(4, 3, 1.0));
  for (PetscInt left = 0; left < 4 * sheet.elements.global; ++left) {
    ActiveSet active(sheet);
    for (std::size_t t = 0; t < active.triangles.size(); ++t) {
      active.triangles[t] = id_of_triangle(sheet, t) == left;
    }
    const Gathered drawn(sheet, cut_surface(sheet, active, unburnt(sheet)), sheet.rest);
    ASSERT_EQ(drawn.triangles.size(), 1u);
    ASSERT_EQ(drawn.points.size(), 3u);
    for (const Gathered::Point& point : drawn.points) {
      EXPECT_TRUE(point.is_owned) << "triangle " << left << ", point " << point.id;
    }
  }
}

TEST(CutSurface, NothingLeftIsNothingDrawn) {
  const Sheet sheet = shell_of(grid_mesh(4, 3, 1.0));
  const DrawnSurface burnt =
      cut_surface(sheet, ActiveSet(sheet), std::vector<double>(sheet.persistent_id.size(), -0.1));
  EXPECT_TRUE(burnt.points.empty() && burnt.triangles.empty() && burnt.elements.empty());
}

TEST(CutSurface, AreaBurntByACircularFrontIsThatOfTheCircle) {
  const double radius = 0.3;
  const double circle = M_PI * radius * radius;
  std::vector<double> errors;
  for (const int cells : {20, 40, 80}) {
    const Sheet sheet = shell_of(grid_mesh(cells, cells, 1.0 / cells));
    const std::vector<double> level = level_of(sheet, [radius](double x, double y) {
      return (x - 0.47) * (x - 0.47) + (y - 0.52) * (y - 0.52) - radius * radius;
    });
    errors.push_back((1 - area(cut_surface(sheet, ActiveSet(sheet), level), sheet.rest)) / circle - 1);
  }
  EXPECT_LT(std::abs(errors[1]), 0.01);
  EXPECT_GT(std::log2(errors[0] / errors[1]), 1.8);
  EXPECT_GT(std::log2(errors[1] / errors[2]), 1.8);
  print_once("burnt circle, relative error of the area at 20, 40, 80 cells: %.2e %.2e %.2e\n", errors[0], errors[1],
             errors[2]);
}

// The distance from the middle falls everywhere by the same amount each step, and what the level set kills goes. A
// front of slope 1 moves by that amount: the area falls by it times the length of the front, and nothing jumps when
// triangles die.
TEST(CutSurface, AreaFollowsTheLevelWithoutJumps) {
  const int cells = 20;
  const double step = 0.05 / cells;
  const Sheet sheet = shell_of(grid_mesh(cells, cells, 1.0 / cells));
  ActiveSet active(sheet);
  double before = 1;
  double largest = 0;
  double smallest = 1;
  for (double radius = 0.2; radius < 0.4; radius += step) {
    const std::vector<double> level =
        level_of(sheet, [radius](double x, double y) { return std::hypot(x - 0.47, y - 0.52) - radius; });
    burn_away(sheet, SpringRule::surface, active, level);
    const double now = area(cut_surface(sheet, active, level), sheet.rest);
    EXPECT_DOUBLE_EQ(now, area(cut_surface(sheet, ActiveSet(sheet), level), sheet.rest))
        << "a triangle dies when nothing of it is drawn any more";
    if (before < 1) {
      const double explained = 2 * M_PI * radius * step;
      largest = std::max(largest, (before - now) / explained);
      smallest = std::min(smallest, (before - now) / explained);
    }
    before = now;
  }
  EXPECT_LT(largest, 1.1);
  EXPECT_GT(smallest, 0.9);
  print_once("moving front, change of the area over what the level explains: %.4f to %.4f\n", smallest, largest);
}

// Corner 0 keeps 0.3 and all others -0.1: its two triangles are cut at 3/4 of the ways from it.
TEST(CutSurface, CutPointsLieAtTheZeroOfTheLevel) {
  const Sheet sheet = shell_of(grid_mesh(1, 1, 1.0));
  const std::vector<double> level = level_by_id(sheet, [](PetscInt id) { return id == 0 ? 0.3 : -0.1; });
  const Gathered drawn(sheet, cut_surface(sheet, ActiveSet(sheet), level), sheet.rest);
  std::map<std::int64_t, Place> expected{{0, {0, 0, 0}}};  // Particles: corners 0 to 3, lattice point 4.
  const auto cut = [](std::int64_t a, std::int64_t b) { return -(a * cut_id_stride + b) - 1; };
  expected[cut(0, 1)] = {0.75, 0, 0};
  expected[cut(0, 2)] = {0, 0.75, 0};
  expected[cut(0, 4)] = {0.375, 0.375, 0};
  ASSERT_EQ(drawn.points.size(), expected.size());
  for (const Gathered::Point& point : drawn.points) {
    ASSERT_EQ(expected.count(point.id), 1u) << point.id;
    for (std::size_t d = 0; d < 3; ++d) {
      EXPECT_NEAR(point.place[d], expected[point.id][d], 1e-15) << point.id;
    }
  }
  EXPECT_EQ(drawn.triangles.size(), 2u);
}

}  // namespace
}  // namespace pellicle
