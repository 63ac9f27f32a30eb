#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <tuple>

#include "parallel/field.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

constexpr double edge = 0.1;

using Keep = std::function<bool(const Eigen::Vector3d& centre)>;

/// A spring: colour, lesser and greater id, initial length.
using SpringKey = std::tuple<int, PetscInt, PetscInt, double>;

class Compaction : public ::testing::Test {
 protected:
  Compaction() { MPI_Comm_size(PETSC_COMM_WORLD, &ranks_); }

  static int sum(int value) {
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
    return value;
  }

  /// A bent grid with holes in its numbering and a seam in its texture.
  static SurfaceMesh mesh(int nx, int ny) {
    SurfaceMesh mesh = grid_mesh(nx, ny, edge);
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
      mesh.points[i].z() = 0.02 * std::sin(7 * mesh.points[i].x()) * std::cos(5 * mesh.points[i].y());
      mesh.point_id.push_back(static_cast<int>(2 * i + 1));
    }
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
      mesh.face_id.push_back(static_cast<int>(3 * i + 2));
      if (i % static_cast<std::size_t>(nx) >= static_cast<std::size_t>(nx) / 2) {
        for (Eigen::Vector2d& uv : mesh.uv[i]) {
          uv.x() += 0.3;
        }
      }
    }
    return mesh;
  }

  static std::vector<bool> kept(const Sheet& sheet, const Keep& keep) {
    std::vector<bool> result;
    for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
      result.push_back(keep(sheet.rest.col(sheet.lattice[cell])));
    }
    return result;
  }

  /// What moves with a particle in the tests, computed from its id.
  struct ParticleDatum {
    double sine;
    std::int64_t id;  // leaves no gap, whose bytes would be any
  };
  static ParticleDatum datum(PetscInt id) { return {std::sin(id), id}; }

  /// What moves with a cell: bytes that fill no whole number.
  using CellDatum = std::array<char, 3>;
  static CellDatum cell_datum(PetscInt id) {
    return {static_cast<char>(id), static_cast<char>(id / 100), static_cast<char>(id / 10000)};
  }

  static Records particle_data(const Sheet& sheet) {
    std::vector<ParticleDatum> particles;
    for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
      particles.push_back(datum(sheet.persistent_id[i]));
    }
    return Records::of(particles);
  }
  static Records cell_data(const Sheet& sheet) {
    std::vector<CellDatum> cells;
    for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
      const PetscInt lattice = sheet.lattice[cell];
      cells.push_back(cell_datum(sheet.persistent_id[lattice]));
    }
    return Records::of(cells);
  }

  static LoadedSheet compact_with_data(const Sheet& sheet, const Keep& keep, const SheetOptions& options) {
    return compact(sheet, kept(sheet, keep), particle_data(sheet), cell_data(sheet), options);
  }

  static SpringKey key(const Sheet& sheet, Colour colour, PetscInt s) {
    const SpringSet& set = sheet.of(colour);
    const auto& [a, b] = set.ends[s];
    const PetscInt id_a = sheet.persistent_id[a];
    const PetscInt id_b = sheet.persistent_id[b];
    return {static_cast<int>(colour), std::min(id_a, id_b), std::max(id_a, id_b), set.initial_length[s]};
  }

  /// Compares what is left, on all ranks, with what the whole sheet, on this rank alone, says must be left.
  void expect_remainder(const LoadedSheet& compacted, const Sheet& whole, const Keep& keep) const {
    const Sheet& sheet = compacted.sheet;
    const std::vector<bool> stays = kept(whole, keep);
    std::map<PetscInt, PetscInt> particle_of_id;
    for (PetscInt i = 0; i < whole.particles.owned; ++i) {
      particle_of_id[whole.persistent_id[i]] = i;
    }
    std::set<PetscInt> particles;
    std::map<PetscInt, std::array<PetscInt, 4>> corners;  // ids, of a kept cell
    std::vector<int> cell_count(whole.particles.owned, 0);
    for (std::size_t cell = 0; cell < stays.size(); ++cell) {
      if (stays[cell]) {
        const PetscInt id = whole.persistent_id[whole.lattice[cell]];
        particles.insert(id);
        for (std::size_t k = 0; k < 4; ++k) {
          const auto corner = static_cast<std::size_t>(whole.cells[cell][k]);
          corners[id][k] = whole.persistent_id[corner];
          particles.insert(corners[id][k]);
          ++cell_count[corner];
        }
      }
    }
    EXPECT_EQ(sheet.first_lattice_id, whole.first_lattice_id);
    EXPECT_EQ(sheet.id_end, whole.id_end);
    EXPECT_EQ(sheet.particles.global, static_cast<PetscInt>(particles.size()));
    EXPECT_EQ(sheet.elements.global, static_cast<PetscInt>(corners.size()));
    EXPECT_EQ(sheet.particles.global - sheet.elements.global, static_cast<PetscInt>(particles.size() - corners.size()));
    EXPECT_EQ(sum(sheet.particles.owned), static_cast<int>(particles.size()));
    EXPECT_EQ(sum(sheet.elements.owned), static_cast<int>(corners.size()));

    const auto particle_data = compacted.particles.as<ParticleDatum>();
    ASSERT_EQ(static_cast<PetscInt>(particle_data.size()), sheet.particles.local());
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      const PetscInt id = sheet.persistent_id[i];
      ASSERT_EQ(particles.count(id), 1u);
      const PetscInt from = particle_of_id.at(id);
      EXPECT_EQ(sheet.rest.col(i), whole.rest.col(from));
      EXPECT_EQ(sheet.uv.col(i), whole.uv.col(from));
      EXPECT_EQ(sheet.initial_mass[i], whole.initial_mass[from]);
      EXPECT_EQ(sheet.is_lattice[i], id >= whole.first_lattice_id);
      EXPECT_EQ(particle_data[i].id, id);
      EXPECT_EQ(particle_data[i].sine, std::sin(id));
      if (i < sheet.particles.owned) {
        EXPECT_EQ(sheet.cell_count[i], cell_count[from]);
      }
    }
    const auto cell_data = compacted.cells.as<CellDatum>();
    ASSERT_EQ(cell_data.size(), sheet.cells.size());
    for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
      const PetscInt id = sheet.persistent_id[sheet.lattice[cell]];
      EXPECT_EQ(cell_data[cell], cell_datum(id));
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_EQ(sheet.persistent_id[sheet.cells[cell][k]], corners.at(id)[k]);
      }
    }
    for (const Colour colour : all_colours) {
      std::set<SpringKey> expected;
      const SpringSet& springs = whole.of(colour);
      for (PetscInt s = 0; s < springs.owned(); ++s) {
        const auto& triangles = springs.triangles[s];
        const auto left = std::count_if(triangles.begin(), triangles.end(),
                                        [&stays](PetscInt triangle) { return triangle >= 0 && stays[triangle / 4]; });
        if (left == 2 || (left > 0 && colour != Colour::green)) {
          expected.insert(key(whole, colour, s));
        }
      }
      const SpringSet& set = sheet.of(colour);
      EXPECT_EQ(set.layout.global, static_cast<PetscInt>(expected.size())) << colour_names[static_cast<int>(colour)];
      for (PetscInt s = 0; s < set.local(); ++s) {
        EXPECT_EQ(expected.count(key(sheet, colour, s)), 1u) << colour_names[static_cast<int>(colour)];
      }
    }
  }

  void check_compaction(int nx, int ny, const Keep& keep, double imbalance_limit) const {
    SheetOptions options;
    options.thickness = 0.03;
    options.imbalance_limit = imbalance_limit;
    const Sheet whole = make_sheet(PETSC_COMM_SELF, mesh(nx, ny), options);
    const Sheet sheet = make_sheet(PETSC_COMM_WORLD, mesh(nx, ny), options);
    expect_remainder(compact_with_data(sheet, keep, options), whole, keep);
  }

  int ranks_ = 1;
};

bool outside_a_hole(const Eigen::Vector3d& centre) {
  return (centre.head<2>() - Eigen::Vector2d(0.6, 0.5)).norm() > 0.27;
}

bool of_one_colour(const Eigen::Vector3d& centre) {
  return (static_cast<int>(centre.x() / edge) + static_cast<int>(centre.y() / edge)) % 2 == 0;
}

TEST_F(Compaction, KeepsAllButACircularHole) {
  check_compaction(12, 9, outside_a_hole, 1);
  check_compaction(12, 9, outside_a_hole, 100);
}

TEST_F(Compaction, KeepsCellsThatTouchInCornersOnly) {
  check_compaction(9, 8, of_one_colour, 1);
  check_compaction(9, 8, of_one_colour, 100);
}

TEST_F(Compaction, OneCellIsLeftAndOtherRanksAreEmpty) {
  const Keep one = [](const Eigen::Vector3d& centre) {
    return std::abs(centre.x() - 0.75) < edge / 4 && std::abs(centre.y() - 0.15) < edge / 4;
  };
  check_compaction(12, 9, one, 1);
  check_compaction(12, 9, one, 100);
}

TEST_F(Compaction, KeepsUnconnectedParts) {
  const Keep corners = [](const Eigen::Vector3d& centre) {
    return std::abs(centre.x() - 0.6) > 0.4 && std::abs(centre.y() - 0.45) > 0.25;
  };
  check_compaction(12, 9, corners, 1);
  check_compaction(12, 9, corners, 100);
}

TEST_F(Compaction, ASheetWithoutTextureHasNoneAfterwards) {
  SurfaceMesh plain = grid_mesh(4, 4, edge);
  plain.uv.clear();
  const SheetOptions options;
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, plain, options);
  EXPECT_EQ(compact_with_data(sheet, outside_a_hole, options).sheet.uv.cols(), 0);
}

TEST_F(Compaction, CellsStayOnTheirRanksWithinTheLimit) {
  SheetOptions options;
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, mesh(12, 9), options);
  std::set<PetscInt> owned;
  for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
    owned.insert(sheet.persistent_id[sheet.lattice[cell]]);
  }
  const Keep left_third = [](const Eigen::Vector3d& centre) { return centre.x() < 0.4; };
  const PetscInt total = 4 * 9;
  options.imbalance_limit = ranks_;  // even if one rank has them all
  const LoadedSheet stayed = compact_with_data(sheet, left_third, options);
  for (PetscInt cell = 0; cell < stayed.sheet.elements.owned; ++cell) {
    const PetscInt lattice = stayed.sheet.lattice[cell];
    EXPECT_EQ(owned.count(stayed.sheet.persistent_id[lattice]), 1u);
  }
  PetscInt largest = stayed.sheet.elements.owned;
  MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_INT, MPI_MAX, PETSC_COMM_WORLD);
  EXPECT_DOUBLE_EQ(stayed.sheet.partition.imbalance, static_cast<double>(largest) * ranks_ / total);

  // 36 cells: 36, 18, 12 or 9 a rank. METIS leaves one cell too many to a rank at most.
  options.imbalance_limit = 1.2;
  const LoadedSheet moved = compact_with_data(sheet, left_third, options);
  EXPECT_LE(moved.sheet.partition.imbalance, 1.2);
  if (ranks_ > 1) {
    EXPECT_GT(stayed.sheet.partition.imbalance, 1.2);
    EXPECT_GT(moved.sheet.partition.edge_cut, 0);
  }
}

TEST_F(Compaction, SpreadsALoadEvenly) {
  SheetOptions options;
  options.thickness = 0.03;
  const Sheet whole = make_sheet(PETSC_COMM_SELF, mesh(24, 16), options);
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, mesh(24, 16), options);
  const auto spread_again = [&options](const Sheet& divided) {
    std::vector<double> load;
    for (PetscInt i = 0; i < divided.particles.owned; ++i) {
      load.push_back(divided.rest(0, i) < 0.9 && !divided.is_lattice[i] ? 3 : 0);
    }
    return pellicle::spread(divided, load, particle_data(divided), cell_data(divided), options);
  };
  const LoadedSheet spread = spread_again(sheet);
  expect_remainder(spread, whole, [](const Eigen::Vector3d&) { return true; });
  int loaded = 0;  // corners of its cells
  for (PetscInt cell = 0; cell < spread.sheet.elements.owned; ++cell) {
    for (const PetscInt corner : spread.sheet.cells[cell]) {
      loaded += spread.sheet.rest(0, corner) < 0.9 ? 1 : 0;
    }
  }
  EXPECT_LT(loaded * ranks_, 1.15 * sum(loaded));
  EXPECT_LT(spread.sheet.partition.imbalance, 1.1);
  // The load of a cell is that of all its corners, whoever owns them.
  EXPECT_EQ(spread_again(spread.sheet).sheet.persistent_id, spread.sheet.persistent_id);
}

TEST_F(Compaction, TwiceIsTheSameAsOnce) {
  SheetOptions options;
  options.imbalance_limit = 1;  // spread anew each time
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, mesh(12, 9), options);
  const Keep first = [](const Eigen::Vector3d& centre) { return centre.x() > 0.3; };
  const Keep both = [&first](const Eigen::Vector3d& centre) { return first(centre) && outside_a_hole(centre); };
  const LoadedSheet once = compact_with_data(sheet, both, options);
  const LoadedSheet halfway = compact_with_data(sheet, first, options);
  const LoadedSheet twice = compact_with_data(halfway.sheet, outside_a_hole, options);
  EXPECT_EQ(twice.sheet.persistent_id, once.sheet.persistent_id);
  EXPECT_EQ(twice.sheet.particles.ghost_global, once.sheet.particles.ghost_global);
  EXPECT_EQ(twice.sheet.rest, once.sheet.rest);
  EXPECT_EQ(twice.sheet.uv, once.sheet.uv);
  EXPECT_EQ(twice.sheet.initial_mass, once.sheet.initial_mass);
  EXPECT_EQ(twice.sheet.cells, once.sheet.cells);
  EXPECT_EQ(twice.sheet.elements.owned, once.sheet.elements.owned);
  EXPECT_EQ(twice.particles.data(), once.particles.data());
  EXPECT_EQ(twice.cells.data(), once.cells.data());
  for (const Colour colour : all_colours) {
    EXPECT_EQ(twice.sheet.of(colour).ends, once.sheet.of(colour).ends);
    EXPECT_EQ(twice.sheet.of(colour).triangles, once.sheet.of(colour).triangles);
    EXPECT_EQ(twice.sheet.of(colour).initial_length, once.sheet.of(colour).initial_length);
  }
}

// A sheet of which nothing goes and that stays where it is has the numbers that make_sheet gave it.
TEST_F(Compaction, OfNothingChangesNothing) {
  SheetOptions options;
  options.imbalance_limit = 100;
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, mesh(7, 5), options);
  const LoadedSheet same = compact_with_data(
      sheet, [](const Eigen::Vector3d&) { return true; }, options);
  EXPECT_EQ(same.sheet.persistent_id, sheet.persistent_id);
  EXPECT_EQ(same.sheet.cells, sheet.cells);
  EXPECT_EQ(same.sheet.rest, sheet.rest);
  EXPECT_EQ(same.sheet.partition.edge_cut, sheet.partition.edge_cut);
  EXPECT_EQ(same.sheet.partition.imbalance, sheet.partition.imbalance);
  for (const Colour colour : all_colours) {
    EXPECT_EQ(same.sheet.of(colour).ends, sheet.of(colour).ends);
    EXPECT_EQ(same.sheet.of(colour).layout.ghost_global, sheet.of(colour).layout.ghost_global);
  }
}

}  // namespace
}  // namespace pellicle
