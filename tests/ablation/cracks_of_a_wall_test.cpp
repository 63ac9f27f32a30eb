#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "ablation/ablation.h"
#include "ablation/cracks.h"
#include "surface/membrane.h"
#include "tests/ablation/sheets.h"

namespace pellicle::cracks_of_a_wall_test {
namespace {

constexpr int columns = 12;
constexpr double edge = 0.1;      // [m]
constexpr double min_mass = 0.5;  // share

PetscInt vertex(int i, int j) { return j * (columns + 1) + i; }

/// Two rows of squares of two triangles each, of mass 1 each.
class CracksOfAWall : public ::testing::Test {
 protected:
  CracksOfAWall() {
    options_.strength = 100;
    options_.char_strength = 0.2;
    options_.strength_length = 0;
    position_.values() = membrane_.rest;
    pinned_.assign(membrane_.initial_mass.size(), false);
    set_mass(1);
    set_stress(0, {1, 0, 0});
  }

  static Membrane strip() {
    const SurfaceMesh mesh = grid_mesh(columns, 2, edge);
    SurfaceMesh triangles;
    triangles.points = mesh.points;
    for (const auto& face : mesh.faces) {
      triangles.faces.push_back({face[0], face[1], face[2]});
      triangles.faces.push_back({face[0], face[2], face[3]});
    }
    Membrane membrane = make_membrane(PETSC_COMM_WORLD, triangles, {});
    set_burnable(membrane, std::vector<double>(membrane.triangles.size(), 1.0));
    return membrane;
  }

  /// Uniaxial stress everywhere [N/m].
  void set_stress(double stress, const Eigen::Vector3d& direction) {
    const Eigen::Vector3d d = direction.normalized();
    stress_.assign(membrane_.triangles.size(), stress * d * d.transpose());
  }
  /// Some stress along x in both triangles of a square of the lower row [N/m].
  void set_stress_of(int column, double stress) {
    for (std::size_t e = 0; e < stress_.size(); ++e) {
      if (membrane_.element_id[e] / 2 == column) {
        stress_[e] = stress * Eigen::Vector3d::UnitX() * Eigen::RowVector3d::UnitX();
      }
    }
  }
  void set_mass(double ratio) {
    for (std::size_t i = 0; i < membrane_.initial_mass.size(); ++i) {
      mass_.data()[i] = ratio * membrane_.initial_mass[i];
    }
  }

  std::vector<PetscInt> own_cracks() {
    Cracks cracks(membrane_, options_, {});
    return cracks.sides({active_, stress_, position_, mass_, pinned_, min_mass});
  }
  /// The ids of the ends of the sides that crack, of all ranks, each as often as a rank has it.
  std::vector<std::array<PetscInt, 2>> cracks() {
    std::vector<std::array<PetscInt, 2>> own;
    for (const PetscInt side : own_cracks()) {
      const auto [a, b] = membrane_.of(Colour::blue).ends[side];
      const auto [low, high] = std::minmax(membrane_.persistent_id[a], membrane_.persistent_id[b]);
      own.push_back({low, high});
    }
    return gathered(PETSC_COMM_WORLD, own);
  }

  Membrane membrane_ = strip();
  ActiveSet active_{membrane_};
  Field position_{membrane_.particles, 3};
  Field mass_{membrane_.particles, 1};
  std::vector<bool> pinned_;
  std::vector<Eigen::Matrix3d> stress_;
  AblationOptions options_;
};

using Sides = std::vector<std::array<PetscInt, 2>>;

/// All sides along y inside the strip.
Sides across_x() {
  Sides sides;
  for (int j = 0; j < 2; ++j) {
    for (int i = 1; i < columns; ++i) {
      sides.push_back({vertex(i, j), vertex(i, j + 1)});
    }
  }
  return sides;
}

TEST_F(CracksOfAWall, RunAcrossTheStressThatExceedsTheStrength) {
  set_stress(99.99, {1, 0, 0});
  EXPECT_EQ(cracks(), Sides{});
  set_stress(100.01, {1, 0, 0});
  EXPECT_EQ(cracks(), across_x()) << "what is equal cracks together";
  set_stress(-1000, {1, 0, 0});
  EXPECT_EQ(cracks(), Sides{}) << "nothing cracks under compression";
  // Pulled across the diagonals of the squares, which alone are at right angles to it.
  set_stress(100.01, {1, -1, 0});
  const Sides diagonal = cracks();
  EXPECT_EQ(diagonal.size(), 2U * columns);
  for (const auto& [a, b] : diagonal) {
    EXPECT_EQ(b - a, columns + 2);
  }
}

TEST_F(CracksOfAWall, AreWhereOfTheSidesThatMeetMostIsPulled) {
  // A side has the mean of the stresses of the triangles beside it: with an idle one less than the strength.
  set_stress_of(4, 195);
  EXPECT_EQ(cracks(), (Sides{{vertex(4, 0), vertex(5, 1)}})) << "between two triangles that are pulled alike";
  set_stress_of(5, 150);
  set_stress_of(9, 130);
  set_stress_of(10, 120);
  EXPECT_EQ(cracks(), (Sides{{vertex(5, 0), vertex(5, 1)}, {vertex(10, 0), vertex(10, 1)}}));
}

TEST_F(CracksOfAWall, BeginSoonerWhereItHasCharred) {
  // c = 0.2 + 0.8 (m - m^min)/(1 - m^min): 0.6 at three quarters of the mass.
  set_mass(0.75);
  set_stress(59.9, {1, 0, 0});
  EXPECT_EQ(cracks(), Sides{});
  set_stress(60.1, {1, 0, 0});
  EXPECT_EQ(cracks(), across_x());
  set_mass(min_mass);
  set_stress(20.1, {1, 0, 0});
  EXPECT_EQ(cracks(), across_x());
}

TEST_F(CracksOfAWall, DependOnTheSeed) {
  options_.strength_scatter = 0.5;
  options_.scatter_length = 3 * edge;
  set_stress(90, {1, 0, 0});
  const Sides some = cracks();
  EXPECT_FALSE(some.empty());
  EXPECT_LT(some.size(), across_x().size());
  options_.seed = 7;
  EXPECT_NE(cracks(), some);
}

TEST_F(CracksOfAWall, SpareWhatIsPinnedBurntOrCrackedAlready) {
  set_stress(150, {1, 0, 0});
  for (std::size_t i = 0; i < pinned_.size(); ++i) {
    pinned_[i] = membrane_.persistent_id[i] % (columns + 1) == 3;  // a column
  }
  Sides left;
  for (const auto& side : across_x()) {
    if (side[0] % (columns + 1) != 3) {
      left.push_back(side);
    }
  }
  EXPECT_EQ(cracks(), left);
  pinned_.assign(pinned_.size(), false);
  for (std::size_t e = 0; e < active_.triangles.size(); ++e) {
    active_.triangles[e] = membrane_.element_id[e] / 2 != 3;  // a square of the lower row
  }
  const Sides beside = cracks();
  EXPECT_EQ(beside.size(), across_x().size() - 2);
  EXPECT_EQ(std::count(beside.begin(), beside.end(), std::array{vertex(3, 0), vertex(3, 1)}), 0);
  EXPECT_EQ(std::count(beside.begin(), beside.end(), std::array{vertex(4, 0), vertex(4, 1)}), 0);
}

TEST_F(CracksOfAWall, AreKnownToBothElementsOnEveryRank) {
  set_stress(150, {1, 0, 0});
  EXPECT_TRUE(crack(membrane_, SpringRule::surface, active_, own_cracks()));
  EXPECT_FALSE(crack(membrane_, SpringRule::surface, active_, {}));
  for (std::size_t side = 0; side < active_.cracked.size(); ++side) {
    const auto x = [&](std::size_t k) { return membrane_.rest(0, membrane_.corner(side / 3, k)) / edge; };
    const bool along_y = std::abs(x(side % 3) - x(side % 3 + 1)) < 0.1;
    const double place = x(side % 3);
    EXPECT_EQ(active_.cracked[side], along_y && place > 0.5 && place < columns - 0.5);
  }
  EXPECT_TRUE(std::all_of(active_.triangles.begin(), active_.triangles.end(), [](bool lives) { return lives; }));
  Sides both = across_x();
  const Sides next = cracks();
  both.insert(both.end(), next.begin(), next.end());
  EXPECT_EQ(std::set(both.begin(), both.end()).size(), both.size()) << "what has cracked does not crack again";
}

}  // namespace
}  // namespace pellicle::cracks_of_a_wall_test
