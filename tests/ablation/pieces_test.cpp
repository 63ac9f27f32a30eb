#include "surface/pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <random>
#include <utility>

#include "ablation/ablation.h"
#include "surface/shell.h"
#include "tests/ablation/sheets.h"
#include "tests/support/balls.h"

namespace pellicle {
namespace {

/// A grid of unit cells whose rows burn.
class BurningRows {
 public:
  BurningRows(int nx, int ny)
      : nx_(nx), sheet_(shell_of(grid_mesh(nx, ny, 1))), active_(sheet_), pieces_(initial_pieces(sheet_)) {}

  /// Burns everything from y = from to y = to, where vertices have whole y.
  void burn(double from, double to) { bands_.emplace_back(from, to); }

  /// Lets what has burnt die.
  void update(double time) {
    burn_away(sheet_, SpringRule::surface, active_, level_by_id(sheet_, [this](PetscInt id) {
                const double y = height(id);
                return std::any_of(bands_.begin(), bands_.end(),
                                   [y](const auto& band) { return band.first <= y && y <= band.second; })
                           ? -1.0
                           : 1.0;
              }));
    update_pieces(pieces_, sheet_, active_, time);
  }

  double height(PetscInt id) const {
    const PetscInt cell = id - sheet_.first_lattice_id;
    const PetscInt row = cell < 0 ? id / (nx_ + 1) : cell / nx_;
    return static_cast<double>(row) + (cell < 0 ? 0 : 0.5);
  }

  /// Expects the piece of every local particle, by its height.
  void expect_pieces(const std::function<PetscInt(double)>& piece_at) const {
    for (std::size_t i = 0; i < sheet_.persistent_id.size(); ++i) {
      const double y = height(sheet_.persistent_id[i]);
      EXPECT_EQ(pieces_.of_particle[i], piece_at(y)) << "particle " << sheet_.persistent_id[i] << " at " << y;
    }
  }

  /// Expects these pieces, ids and times of birth.
  void expect_present(const std::vector<std::pair<PetscInt, double>>& expected) const {
    std::vector<std::pair<PetscInt, double>> present;
    for (std::size_t k = 0; k < pieces_.present.size(); ++k) {
      present.emplace_back(pieces_.present[k], pieces_.birth_time[k]);
    }
    EXPECT_EQ(present, expected);
  }

  const Sheet& sheet() const { return sheet_; }
  const Pieces& pieces() const { return pieces_; }

 private:
  int nx_;
  Sheet sheet_;
  ActiveSet active_;
  Pieces pieces_;
  std::vector<std::pair<double, double>> bands_;
};

TEST(Pieces, ASheetBeginsAsOnePieceAndTwoAsTwo) {
  const BurningRows rows(5, 4);
  rows.expect_present({{0, 0}});
  EXPECT_EQ(rows.pieces().next_id, 1);
  rows.expect_pieces([](double) { return 0; });

  // The second sheet has more particles, the first the least id.
  const Sheet two = shell_of(joined(grid_mesh(3, 2, 1), grid_mesh(4, 3, 1), {10, 0, 0}));
  const Pieces pieces = initial_pieces(two);
  ASSERT_EQ(pieces.present.size(), 2U);
  EXPECT_EQ(pieces.next_id, 2);
  for (std::size_t i = 0; i < pieces.of_particle.size(); ++i) {
    EXPECT_EQ(pieces.of_particle[i], two.rest(0, static_cast<Eigen::Index>(i)) > 5 ? 1 : 0);
  }
  const std::vector<double> masses = piece_masses(pieces, two, initial_masses(two));
  EXPECT_NEAR(masses[0], 6 * test_density, 1e-13);
  EXPECT_NEAR(masses[1], 12 * test_density, 1e-13);
}

TEST(Pieces, ABurntRowOfCellsSplitsTheSheet) {
  BurningRows rows(6, 8);
  rows.burn(2, 3);
  rows.update(1);
  rows.expect_present({{0, 0}, {1, 1}});
  EXPECT_EQ(rows.pieces().next_id, 2);
  rows.expect_pieces([](double y) { return y == 2.5 ? -1 : y > 2.5 ? 0 : 1; });  // The larger part keeps the id.
  // Half of a cell's mass is in its lattice point, an eighth in each corner; the lattice points at y = 2.5 have left.
  const std::vector<double> masses = piece_masses(rows.pieces(), rows.sheet(), initial_masses(rows.sheet()));
  ASSERT_EQ(masses.size(), 2U);
  EXPECT_NEAR(masses[0], (30 / 2.0 + (4 * 30 + 12) / 8.0) * test_density, 1e-12);
  EXPECT_NEAR(masses[1], (12 / 2.0 + (4 * 12 + 12) / 8.0) * test_density, 1e-12);
}

TEST(Pieces, IdsPersistThroughSplits) {
  BurningRows rows(2, 32);
  rows.burn(15, 17);  // Two equal parts: the one of the least persistent id keeps the id.
  rows.update(1);
  rows.expect_present({{0, 0}, {1, 1}});
  const auto is_near = [](double y, double middle) { return std::abs(y - middle) < 1; };
  rows.expect_pieces([&](double y) { return is_near(y, 16) ? -1 : y < 16 ? 0 : 1; });

  rows.update(2);  // Nothing new.
  rows.expect_present({{0, 0}, {1, 1}});

  rows.burn(3, 5);    // Off piece 0, whose upper part has more particles,
  rows.burn(19, 21);  // and off piece 1 twice at once, of which the middle has most.
  rows.burn(27, 29);
  rows.update(3);
  rows.expect_present({{0, 0}, {1, 1}, {2, 3}, {3, 3}, {4, 3}});
  rows.expect_pieces([&](double y) {
    if (is_near(y, 4) || is_near(y, 16) || is_near(y, 20) || is_near(y, 28)) {
      return -1;
    }
    return y < 4 ? 2 : y < 16 ? 0 : y < 20 ? 3 : y < 28 ? 1 : 4;
  });

  rows.burn(5, 15);  // Piece 0 burns away, the others lose the particles that it had constrained.
  rows.burn(-1, 1);
  rows.burn(23, 25);  // Equal parts again.
  rows.update(4);
  rows.expect_present({{1, 1}, {2, 3}, {3, 3}, {4, 3}, {5, 4}});
  EXPECT_EQ(rows.pieces().next_id, 6);
  rows.expect_pieces([&](double y) {
    if (y < 1 || (y > 3 && y < 17) || is_near(y, 20) || is_near(y, 24) || is_near(y, 28)) {
      return -1;
    }
    return y < 4 ? 2 : y < 20 ? 3 : y < 24 ? 1 : y < 28 ? 5 : 4;
  });
}

TEST(Pieces, NothingIsLeftOfASheetThatHasBurnt) {
  BurningRows rows(5, 4);
  rows.burn(0, 4);
  rows.update(1);
  rows.expect_present({});
  rows.expect_pieces([](double) { return -1; });
  EXPECT_EQ(rows.pieces().next_id, 1);
  EXPECT_TRUE(piece_masses(rows.pieces(), rows.sheet(), initial_masses(rows.sheet())).empty());
  rows.update(2);
  rows.expect_present({});
}

/// A sheet on which points burn, each at its own time.
class ScatteredFire {
 public:
  ScatteredFire(const SurfaceMesh& mesh, MPI_Comm comm)
      : sheet_(std::make_unique<Sheet>(shell_of(mesh, comm))), active_(*sheet_), pieces_(initial_pieces(*sheet_)) {}

  /// @param until by persistent id, when the points burn
  void update(const std::vector<double>& until, double time) {
    const auto level = [&until, time](PetscInt id) { return until[id] - time; };
    if (burn_away(*sheet_, SpringRule::surface, active_, level_by_id(*sheet_, level))) {
      update_pieces(pieces_, *sheet_, active_, time);
    }
  }

  /// Removes the cells of which nothing is left, and spreads the others anew when ranks differ at all.
  void remove_empty_cells() {
    std::vector<bool> kept = empty_cells(*sheet_, active_);
    kept.flip();
    using Triangles = std::array<bool, 4>;
    std::vector<PetscInt> piece(pieces_.of_particle);
    piece.resize(sheet_->particles.owned);
    std::vector<Triangles> triangles(sheet_->elements.owned);
    auto lives = active_.triangles.cbegin();
    for (Triangles& of_cell : triangles) {
      std::copy_n(lives, 4, of_cell.begin());
      lives += 4;
    }
    SheetOptions options;
    options.imbalance_limit = 1;
    LoadedSheet compacted = compact(*sheet_, kept, Records::of(piece), Records::of(triangles), options);
    sheet_ = std::make_unique<Sheet>(std::move(compacted.sheet));
    pieces_.of_particle = compacted.particles.as<PetscInt>();
    active_ = ActiveSet(*sheet_);
    active_.triangles.clear();
    for (const Triangles& of_cell : compacted.cells.as<Triangles>()) {
      active_.triangles.insert(active_.triangles.end(), of_cell.begin(), of_cell.end());
    }
    follow_triangles(*sheet_, SpringRule::surface, active_);
  }

  const Sheet& sheet() const { return *sheet_; }
  const ActiveSet& active() const { return active_; }
  const Pieces& pieces() const { return pieces_; }

 private:
  std::unique_ptr<Sheet> sheet_;
  ActiveSet active_;
  Pieces pieces_;
};

/// When each point of a sheet burns, by persistent id, at random from 0 to 1.
std::vector<double> random_times(const Sheet& sheet, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<double> until(sheet.id_end);
  for (double& time : until) {
    time = std::uniform_real_distribution<double>(0, 1)(random);
  }
  return until;
}

/// Expects the same pieces, and that every active spring joins particles of one piece.
/// @param alone on a single rank, with all its cells
void expect_same_pieces(const ScatteredFire& fire, const ScatteredFire& alone) {
  std::map<PetscInt, PetscInt> expected;
  for (std::size_t i = 0; i < alone.sheet().persistent_id.size(); ++i) {
    expected[alone.sheet().persistent_id[i]] = alone.pieces().of_particle[i];
  }
  for (std::size_t i = 0; i < fire.sheet().persistent_id.size(); ++i) {
    const PetscInt id = fire.sheet().persistent_id[i];
    EXPECT_EQ(fire.pieces().of_particle[i], expected.at(id)) << "particle " << id;
  }
  ASSERT_EQ(fire.pieces().present.size(), alone.pieces().present.size());
  for (std::size_t k = 0; k < fire.pieces().present.size(); ++k) {
    EXPECT_EQ(fire.pieces().present[k], alone.pieces().present[k]);
    EXPECT_EQ(fire.pieces().birth_time[k], alone.pieces().birth_time[k]);
  }
  EXPECT_EQ(fire.pieces().next_id, alone.pieces().next_id);
  for (const Colour colour : all_colours) {
    const SpringSet& set = fire.sheet().of(colour);
    for (std::size_t s = 0; s < set.ends.size(); ++s) {
      if (fire.active().springs[static_cast<std::size_t>(colour)][s]) {
        const PetscInt piece = fire.pieces().of_particle[set.ends[s][0]];
        EXPECT_GE(piece, 0);
        EXPECT_EQ(piece, fire.pieces().of_particle[set.ends[s][1]]);
      }
    }
  }
}

TEST(Pieces, DependNeitherOnRanksNorOnTheOrderOfTheParticles) {
  const SurfaceMesh mesh = grid_mesh(16, 12, 1);
  std::size_t most = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    ScatteredFire fire(mesh, PETSC_COMM_WORLD);
    ScatteredFire alone(mesh, PETSC_COMM_SELF);
    const std::vector<double> until = random_times(alone.sheet(), seed);
    for (int step = 1; step <= 10; ++step) {
      SCOPED_TRACE(step);
      fire.update(until, 0.1 * step);
      alone.update(until, 0.1 * step);
      expect_same_pieces(fire, alone);
      most = std::max(most, fire.pieces().present.size());
    }
    EXPECT_TRUE(fire.pieces().present.empty()) << "all has burnt in the end";
  }
  EXPECT_GT(most, 5U);
}

TEST(Pieces, DoNotDependOnCompaction) {
  const SurfaceMesh mesh = grid_mesh(16, 12, 1);
  for (const int every : {1, 3}) {
    ScatteredFire fire(mesh, PETSC_COMM_WORLD);
    ScatteredFire alone(mesh, PETSC_COMM_SELF);
    const std::vector<double> until = random_times(alone.sheet(), 4);
    for (int step = 1; step <= 9; ++step) {
      SCOPED_TRACE(step);
      fire.update(until, 0.1 * step);
      alone.update(until, 0.1 * step);
      if (step % every == 0) {
        fire.remove_empty_cells();
      }
      expect_same_pieces(fire, alone);
    }
    EXPECT_LT(fire.sheet().elements.global, 3 * 16 * 12 / 4);
    EXPECT_FALSE(fire.pieces().present.empty());
  }
}

}  // namespace
}  // namespace pellicle
