#include "contact/crack_faces.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <optional>
#include <utility>
#include <vector>

#include "geometry/triangle_intersection.h"
#include "surface/membrane.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

/// Where the corner that is split is.
const Eigen::Vector3d corner(3, -20, 8);

CrackedSurface cracked(const Membrane& membrane, double thickness, std::vector<CrackFace> crack_faces,
                       Field& position) {
  return {{&membrane, thickness, 1},
          nullptr,
          std::vector<bool>(static_cast<std::size_t>(membrane.particles.local())),
          std::move(crack_faces),
          position};
}

// Triangles of a balloon that bursts, folded, whose common corner is split: one round one crack face, five round the
// other. Each moved inwards the crack faces would let two of them cut through each other.
TEST(Lips, OfAFoldOpenWithoutCuttingThroughEachOther) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  SurfaceMesh mesh;
  if (rank == 0) {
    mesh.points = {{-5.11, -4.97, -5.59}, {0.95, -6.41, -1.2}, {0, 0, 0},           {0, 0, 0},
                   {6.96, 0.33, 7.43},    {2.9, 5.16, 3.37},   {0.95, -6.41, -1.2}, {-3.99, -3.07, -5.62},
                   {-3.45, -5.82, 1.22},  {-3.83, 4.33, -6.25}};
    mesh.faces = {{2, 0, 1}, {3, 4, 5}, {3, 6, 4}, {3, 7, 8}, {3, 5, 9}, {3, 9, 7}};
  }
  mesh = moved(mesh, corner);
  const Membrane membrane = make_membrane(PETSC_COMM_WORLD, mesh, SheetOptions());
  Field position(membrane.particles, 3);
  position.values() = membrane.rest;
  constexpr double thickness = 1.5;
  separate_crack_faces({cracked(membrane, thickness, {{2, 2}, {2, 3}}, position)});
  const Eigen::Matrix3Xd at = by_id(membrane, position).colwise() - corner;
  EXPECT_NEAR(at.col(2).norm(), lip_share * thickness, 1e-12);
  EXPECT_GE((at.col(3) - at.col(2)).norm(), lip_share * thickness / 2);
  const auto triangle = [&at](Eigen::Index a, Eigen::Index b, Eigen::Index c) {
    return Triangle{at.col(a), at.col(b), at.col(c)};
  };
  const Triangle alone = triangle(2, 0, 1);
  for (const Triangle& other : {triangle(3, 4, 5), triangle(3, 7, 8), triangle(3, 5, 9), triangle(3, 9, 7)}) {
    EXPECT_FALSE(triangles_intersect(alone, other));
  }
}

// A crack face at the tip of a cone goes into it, where there is another cone, of the same surface or of another one.
void expect_to_stop_short(bool is_one_surface) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  constexpr double thickness = 0.1;
  constexpr double apart = 0.2 * lip_share * thickness;
  SurfaceMesh lower;  // the cone whose tip is split, and a triangle at the other crack face
  SurfaceMesh upper;
  if (rank == 0) {
    const auto add_cone = [](SurfaceMesh& mesh, double up) {
      const auto tip = static_cast<int>(mesh.points.size());
      mesh.points.emplace_back(0, 0, up);
      for (const auto& [x, y] : {std::pair(1, 0), {0, 1}, {-1, 0}, {0, -1}}) {
        mesh.points.emplace_back(x, y, 1 + up);
      }
      for (int k = 0; k < 4; ++k) {
        mesh.faces.push_back({tip, tip + 1 + k, tip + 1 + (k + 1) % 4});
      }
    };
    lower.points = {{0, 0, 0}, {1, 0, -1}, {-1, 0.5, -1}};
    lower.faces = {{0, 1, 2}};
    add_cone(lower, 0);
    add_cone(is_one_surface ? lower : upper, apart);
  }
  const Membrane membrane = make_membrane(PETSC_COMM_WORLD, moved(lower, corner), SheetOptions());
  Field position(membrane.particles, 3);
  position.values() = membrane.rest;
  std::vector<CrackedSurface> surfaces{cracked(membrane, thickness, {{3, 0}, {3, 3}}, position)};
  const std::optional<Membrane> other =
      is_one_surface ? std::nullopt
                     : std::optional(make_membrane(PETSC_COMM_WORLD, moved(upper, corner), SheetOptions()));
  std::optional<Field> of_other;
  if (other) {
    of_other.emplace(other->particles, 3);
    of_other->values() = other->rest;
    surfaces.push_back(cracked(*other, thickness, {}, *of_other));
  }
  separate_crack_faces(surfaces);
  const Eigen::Matrix3Xd at = by_id(membrane, position).colwise() - corner;
  EXPECT_GT(at(2, 3), 0.1 * apart);
  EXPECT_LT(at(2, 3), apart);
  EXPECT_NEAR(at.col(0).norm(), lip_share * thickness, 1e-12);
  if (other) {
    EXPECT_EQ((of_other->values() - other->rest).norm(), 0) << "what has not cracked stays";
  }
}

TEST(Lips, StopShortOfAnotherLayer) { expect_to_stop_short(true); }

TEST(Lips, StopShortOfAnotherSurface) { expect_to_stop_short(false); }

}  // namespace
}  // namespace pellicle
