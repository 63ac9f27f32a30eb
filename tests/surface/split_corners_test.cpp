#include "surface/split_corners.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

#include "parallel/collective.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle::split_corners_test {
namespace {

constexpr int nx = 4;
constexpr int ny = 3;
constexpr double edge = 0.1;  // [m]

constexpr PetscInt vertex(int i, int j) { return j * (nx + 1) + i; }
constexpr PetscInt cell(int i, int j) { return j * nx + i; }

/// Corners of all cells by the cells' ids, and masses of the vertices by their ids.
struct WholeSheet {
  std::map<PetscInt, std::array<PetscInt, 4>> corners;
  std::map<PetscInt, double> mass;
  std::map<PetscInt, std::array<double, 3>> place;
};

/// A grid of cells whose areas differ, and cracks in it.
class SplitCornersTest : public ::testing::Test {
 protected:
  static SurfaceMesh mesh() {
    SurfaceMesh mesh = grid_mesh(nx, ny, edge);
    for (Eigen::Vector3d& point : mesh.points) {
      point.x() *= 1 + point.x();
    }
    mesh.groups["rim"] = {0, 1, 2, 3, 4};
    return mesh;
  }
  static SheetOptions options() {
    SheetOptions options;
    options.areal_density = 2;
    return options;
  }

  /// Cracks the sides with these ends.
  void crack(const std::set<std::pair<PetscInt, PetscInt>>& sides) {
    for (std::size_t c = 0; c < sheet_.cells.size(); ++c) {
      for (std::size_t k = 0; k < 4; ++k) {
        const auto id = [&](std::size_t corner) { return sheet_.persistent_id[sheet_.cells[c][corner % 4]]; };
        if (sides.count(std::minmax(id(k), id(k + 1))) > 0) {
          active_.cracked[4 * c + k] = true;
        }
      }
    }
  }

  void kill(PetscInt element) {
    for (std::size_t c = 0; c < sheet_.cells.size(); ++c) {
      if (sheet_.element_id[c] == element) {
        std::fill_n(active_.triangles.begin() + static_cast<std::ptrdiff_t>(4 * c), 4, false);
      }
    }
  }

  /// What is left when corners have been split; its records are the ids that particles had. Collective.
  WholeSheet split_sheet(PetscInt expected_copies) {
    const SplitCorners corners = find_split_corners(sheet_, active_);
    EXPECT_EQ(corners.count, expected_copies);
    std::vector<PetscInt> before(sheet_.persistent_id.begin(), sheet_.persistent_id.begin() + sheet_.particles.owned);
    std::vector<PetscInt> of_copies;
    for (const SplitCorners::Copy& copy : corners.copies) {
      of_copies.push_back(sheet_.persistent_id[copy.original]);
    }
    LoadedSheet loaded = split(sheet_, corners, Records::of(before), Records::of(of_copies),
                               Records(0, sheet_.elements.owned), options());
    const Sheet& sheet = loaded.sheet;
    EXPECT_EQ(sheet.id_end, sheet_.id_end + expected_copies);
    EXPECT_EQ(sheet.particles.global - sheet.elements.global,
              sheet_.particles.global - sheet_.elements.global + expected_copies);
    EXPECT_EQ(sheet.elements.global, sheet_.elements.global) << "no cell is lost";
    const auto was = loaded.particles.as<PetscInt>();
    const auto mesh_points = mesh().points;
    for (std::size_t i = 0; i < was.size(); ++i) {
      const PetscInt id = sheet.persistent_id[i];
      EXPECT_TRUE(id == was[i] || id >= sheet_.id_end);
      if (!sheet.is_lattice[i]) {
        EXPECT_EQ(sheet.rest.col(static_cast<Eigen::Index>(i)), mesh_points.at(static_cast<std::size_t>(was[i])));
        const auto& rim = sheet.groups.at("rim");
        EXPECT_EQ(std::count(rim.begin(), rim.end(), static_cast<PetscInt>(i)), was[i] < 5 ? 1 : 0);
      }
    }
    return gather(sheet);
  }

  static WholeSheet gather(const Sheet& sheet) {
    struct Row {
      PetscInt id;
      double mass;
      std::array<double, 3> place;
    };
    std::vector<Row> rows;
    for (PetscInt i = 0; i < sheet.owned_corners; ++i) {
      const auto k = static_cast<std::size_t>(i);
      rows.push_back(
          {sheet.persistent_id[k], sheet.initial_mass[k], {sheet.rest(0, i), sheet.rest(1, i), sheet.rest(2, i)}});
    }
    std::vector<std::array<PetscInt, 5>> cells;
    for (PetscInt c = 0; c < sheet.elements.owned; ++c) {
      std::array<PetscInt, 5>& row = cells.emplace_back();
      row[0] = sheet.element_id[c];
      for (std::size_t k = 0; k < 4; ++k) {
        row[k + 1] = sheet.persistent_id[sheet.cells[c][k]];
      }
    }
    WholeSheet whole;
    for (const Row& row : of_all_ranks(sheet.comm(), rows)) {
      EXPECT_TRUE(whole.mass.emplace(row.id, row.mass).second) << "id " << row.id << " twice";
      whole.place[row.id] = row.place;
    }
    for (const auto& row : of_all_ranks(sheet.comm(), cells)) {
      std::copy(row.begin() + 1, row.end(), whole.corners[row[0]].begin());
    }
    return whole;
  }

  Sheet sheet_ = make_sheet(PETSC_COMM_WORLD, mesh(), options());
  ActiveSet active_{sheet_};
  const PetscInt next_ = sheet_.id_end;  ///< the first new id
};

TEST_F(SplitCornersTest, ACrackInsideDoesNotOpen) {
  crack({{vertex(2, 1), vertex(2, 2)}});
  EXPECT_EQ(find_split_corners(sheet_, active_).count, 0);
}

TEST_F(SplitCornersTest, ACrackFromTheRimOpensThere) {
  crack({{vertex(2, 0), vertex(2, 1)}});
  const WholeSheet before = gather(sheet_);
  const WholeSheet after = split_sheet(1);
  for (const auto& [id, corners] : after.corners) {
    std::array<PetscInt, 4> expected = before.corners.at(id);
    if (id == cell(2, 0)) {  // of greater id than cell (1, 0)
      EXPECT_EQ(expected[0], vertex(2, 0));
      expected[0] = next_;
    }
    EXPECT_EQ(corners, expected) << "cell " << id;
  }
  // An eighth of the masses of its cells each.
  const auto width = [&](int i) { return before.place.at(vertex(i + 1, 0))[0] - before.place.at(vertex(i, 0))[0]; };
  EXPECT_NEAR(after.mass.at(vertex(2, 0)), 2 * edge * width(1) / 8, 1e-15);
  EXPECT_NEAR(after.mass.at(next_), 2 * edge * width(2) / 8, 1e-15);
  EXPECT_NEAR(after.mass.at(vertex(2, 0)) + after.mass.at(next_), before.mass.at(vertex(2, 0)), 1e-15);
}

TEST_F(SplitCornersTest, ACrackAcrossParts) {
  crack({{vertex(2, 0), vertex(2, 1)}, {vertex(2, 1), vertex(2, 2)}, {vertex(2, 2), vertex(2, 3)}});
  const WholeSheet after = split_sheet(4);
  std::array<std::set<PetscInt>, 2> halves;
  for (const auto& [id, corners] : after.corners) {
    halves[id % nx < 2 ? 0 : 1].insert(corners.begin(), corners.end());
  }
  std::vector<PetscInt> common;
  std::set_intersection(halves[0].begin(), halves[0].end(), halves[1].begin(), halves[1].end(),
                        std::back_inserter(common));
  EXPECT_EQ(common, std::vector<PetscInt>{});
  for (int j = 0; j <= ny; ++j) {
    EXPECT_EQ(halves[0].count(vertex(2, j)), 1U) << "those with the lowest cell keep it";
    EXPECT_EQ(halves[1].count(next_ + j), 1U) << "new ids are in the order of the old ones";
    EXPECT_EQ(after.place.at(next_ + j), after.place.at(vertex(2, j)));
  }
}

TEST_F(SplitCornersTest, AllSidesOfACornerMakeFour) {
  const PetscInt centre = vertex(2, 1);
  crack({{vertex(2, 0), centre}, {vertex(1, 1), centre}, {centre, vertex(3, 1)}, {centre, vertex(2, 2)}});
  // The corner at the rim is parted as well.
  const WholeSheet after = split_sheet(4);
  EXPECT_EQ(after.corners.at(cell(1, 0))[2], centre);
  EXPECT_EQ(after.corners.at(cell(2, 0))[0], next_) << "the rim's corner is that of the lesser id";
  EXPECT_EQ(after.corners.at(cell(2, 0))[3], next_ + 1);
  EXPECT_EQ(after.corners.at(cell(1, 1))[1], next_ + 2);
  EXPECT_EQ(after.corners.at(cell(2, 1))[0], next_ + 3);
}

TEST_F(SplitCornersTest, ACrackEndsInAHole) {
  // Without the hole the crack's other end holds.
  crack({{vertex(2, 1), vertex(2, 2)}});
  kill(cell(2, 2));
  const WholeSheet after = split_sheet(1);
  EXPECT_EQ(after.corners.at(cell(1, 1))[2], vertex(2, 2));
  EXPECT_EQ(after.corners.at(cell(2, 1))[3], next_);
  EXPECT_EQ(after.corners.at(cell(2, 2))[0], vertex(2, 2)) << "what has burnt stays where the corner stays";
}

TEST_F(SplitCornersTest, AHoleAloneSplitsNothing) {
  kill(cell(1, 1));
  kill(cell(2, 2));  // both other cells at their common corner hang together by it alone
  EXPECT_EQ(find_split_corners(sheet_, active_).count, 0);
}

}  // namespace
}  // namespace pellicle::split_corners_test
