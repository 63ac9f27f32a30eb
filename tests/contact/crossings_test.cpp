#include "contact/crossings.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <cmath>

#include "contact/untangle.h"
#include "surface/membrane.h"

namespace pellicle {
namespace {

constexpr double touch = 1e-8;

/// Squares of side 1, cut in two, side by side along x, each of them turned by an angle against the one before it.
SurfaceMesh folded_strip(const std::vector<double>& turns, const Eigen::Vector3d& shift = {0, 0, 0}) {
  SurfaceMesh mesh;
  Eigen::Vector3d along(1, 0, 0);
  Eigen::Vector3d at = shift;
  double angle = 0;
  const auto add_row = [&] {
    mesh.points.push_back(at);
    mesh.points.emplace_back(at + Eigen::Vector3d(0, 1, 0));
  };
  add_row();
  for (const double turn : turns) {
    angle += turn;
    along = {std::cos(angle), 0, std::sin(angle)};
    at += along;
    add_row();
    const auto n = static_cast<int>(mesh.points.size());
    mesh.faces.push_back({n - 4, n - 2, n - 1});
    mesh.faces.push_back({n - 4, n - 1, n - 3});
  }
  return mesh;
}

SurfaceMesh both(SurfaceMesh first, const SurfaceMesh& second) {
  const auto before = static_cast<int>(first.points.size());
  first.points.insert(first.points.end(), second.points.begin(), second.points.end());
  for (std::vector<int> face : second.faces) {
    for (int& corner : face) {
      corner += before;
    }
    first.faces.push_back(face);
  }
  return first;
}

Crossings crossings_of(const SurfaceMesh& mesh) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const Membrane membrane = make_membrane(PETSC_COMM_WORLD, rank == 0 ? mesh : SurfaceMesh(), SheetOptions());
  Field position(membrane.particles, 3);
  position.values() = membrane.rest;
  return find_crossings({{membrane, position, nullptr}}, touch);
}

TEST(Crossings, WhatIsApartFoldedOrSlitDoesNotTouch) {
  EXPECT_EQ(crossings_of(folded_strip({0, 0.3, 3, -2.9})).touching, 0) << "folded by less than 180 degrees";
  EXPECT_EQ(crossings_of(both(folded_strip({0, 0}), folded_strip({0, 0}, {2, 0, 0}))).touching, 0)
      << "corners in one place on both sides of a slit";
  EXPECT_EQ(crossings_of(both(folded_strip({0, 0}), folded_strip({0, 0}, {0.1, 0.1, 3 * touch}))).touching, 0);
}

TEST(Crossings, WhatLiesOnAnotherTouches) {
  for (const Eigen::Vector3d& shift : {Eigen::Vector3d(0.1, 0.1, 0), Eigen::Vector3d(0.1, 0, 0),
                                       Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.2, 0.3, touch / 3)}) {
    const Crossings found = crossings_of(both(folded_strip({0, 0}), folded_strip({0, 0}, shift)));
    EXPECT_GE(found.touching, 4) << shift.transpose();
    EXPECT_EQ(found.pairs, 0) << shift.transpose();
  }
  EXPECT_GT(crossings_of(folded_strip({0, M_PI})).touching, 0) << "folded flat on itself";
  EXPECT_GT(crossings_of(folded_strip({0, M_PI, -M_PI})).touching, 0) << "pleats";
  EXPECT_GT(crossings_of(both(folded_strip({0}), folded_strip({0}, {1, 0.5, 0}))).touching, 0) << "a T";
}

TEST(Crossings, TheFirstOfAllIsNamed) {
  const Crossings found = crossings_of(both(folded_strip({0, 0, 0}), folded_strip({0}, {2.1, 0.2, 0})));
  EXPECT_EQ(found.elements[1], 6);
  EXPECT_GE(found.elements[0], 2);
}

TEST(Crossings, OnlyNewOnesAreNew) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const SurfaceMesh mesh = both(folded_strip({0, 0}), folded_strip({0}, {0.3, 0.2, -0.5}));
  const Membrane membrane = make_membrane(PETSC_COMM_WORLD, rank == 0 ? mesh : SurfaceMesh(), SheetOptions());
  Field before(membrane.particles, 3);
  Field after(membrane.particles, 3);
  before.values() = membrane.rest;
  after.values() = membrane.rest;
  for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
    if (membrane.persistent_id[i] == 7) {
      after.vector(i) += Eigen::Vector3d(0, 0, 1);  // through the strip
    }
  }
  const auto placed = [&](const Field& position) { return std::vector<PlacedSurface>{{membrane, position, nullptr}}; };
  EXPECT_EQ(find_crossings(placed(before)).pairs, 0);
  const int crossed = find_crossings(placed(after)).pairs;
  EXPECT_GT(crossed, 0);
  EXPECT_EQ(find_new_crossings(placed(before), placed(after)).pairs, crossed);
  EXPECT_EQ(find_new_crossings(placed(after), placed(after)).pairs, 0);
  EXPECT_EQ(find_new_crossings(placed(after), placed(before)).pairs, 0);
}

TEST(Untangle, PartsWhatTouches) {
  for (const Eigen::Vector3d& shift : {Eigen::Vector3d(0.1, 0.1, 0), Eigen::Vector3d(0, 0, 0)}) {
    for (const bool is_held : {false, true}) {
      const SurfaceMesh mesh = both(folded_strip({0, 0}), folded_strip({0, 0}, shift));
      TangledMesh tangle;
      tangle.particles = mesh.points;
      tangle.constrained.assign(mesh.points.size(), false);
      std::fill_n(tangle.constrained.begin(), 6, is_held);
      for (const std::vector<int>& face : mesh.faces) {
        tangle.triangles.push_back({face[0], face[1], face[2]});
      }
      tangle.touch = touch;
      EXPECT_EQ(untangle(tangle), 0);
      SurfaceMesh parted = mesh;
      parted.points = tangle.particles;
      EXPECT_EQ(crossings_of(parted).touching, 0) << shift.transpose();
      EXPECT_EQ(crossings_of(parted).pairs, 0) << shift.transpose();
    }
  }
}

}  // namespace
}  // namespace pellicle
