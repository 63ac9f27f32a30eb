#include "ablation/ablation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>

#include "tests/ablation/sheets.h"

namespace pellicle {
namespace {

/// The dead springs of each colour by their ids and the dead triangles by their numbers.
struct Dead {
  std::array<std::set<IdPair>, 4> springs;
  std::set<PetscInt> triangles;
};

/// Expects that every local spring and triangle, ghosts too, is dead exactly if it is among `dead`.
void expect_dead(const Sheet& sheet, const ActiveSet& active, const Dead& dead) {
  for (const Colour colour : all_colours) {
    const auto number = static_cast<std::size_t>(colour);
    for (PetscInt s = 0; s < sheet.of(colour).local(); ++s) {
      const IdPair ids = ids_of(sheet, colour, s);
      EXPECT_EQ(!active.springs[number][s], dead.springs[number].count(ids) == 1)
          << colour_names[number] << ' ' << ids.first << ' ' << ids.second;
    }
  }
  for (std::size_t t = 0; t < active.triangles.size(); ++t) {
    const PetscInt id = id_of_triangle(sheet, t);
    EXPECT_EQ(!active.triangles[t], dead.triangles.count(id) == 1) << "triangle " << id;
  }
}

/// A grid of cells without ranks: the ids of its parts, and which triangles each spring shares, by geometry alone.
struct Grid {
  int nx;
  int ny;

  PetscInt vertex(int i, int j) const { return j * (nx + 1) + i; }
  PetscInt cell(int i, int j) const { return j * nx + i; }
  PetscInt lattice(int i, int j) const { return (nx + 1) * (ny + 1) + cell(i, j); }
  std::array<PetscInt, 4> corners(int i, int j) const {
    return {vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)};
  }

  /// For the springs of each colour the triangles that share them.
  std::array<std::map<IdPair, std::set<PetscInt>>, 4> springs() const {
    std::array<std::map<IdPair, std::set<PetscInt>>, 4> sharing;
    auto& [red, green, blue, yellow] = sharing;
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const std::array<PetscInt, 4> c = corners(i, j);
        const std::array<IdPair, 4> across{IdPair{i, j - 1}, {i + 1, j}, {i, j + 1}, {i - 1, j}};
        for (std::size_t k = 0; k < 4; ++k) {
          const PetscInt triangle = 4 * cell(i, j) + static_cast<PetscInt>(k);
          const PetscInt a = c[k];
          const PetscInt b = c[(k + 1) % 4];
          red[{a, lattice(i, j)}].insert(triangle);
          red[{b, lattice(i, j)}].insert(triangle);
          blue[std::minmax(a, b)].insert(triangle);
          yellow[std::minmax(c[0], c[2])].insert(triangle);
          yellow[std::minmax(c[1], c[3])].insert(triangle);
          const auto [p, q] = across[k];
          if (p >= 0 && p < nx && q >= 0 && q < ny) {
            green[std::minmax(lattice(i, j), lattice(p, q))].insert(triangle);
          }
        }
      }
    }
    return sharing;
  }

  /// What is dead when these triangles are.
  Dead dead(const std::set<PetscInt>& triangles) const {
    Dead dead;
    dead.triangles = triangles;
    std::set<PetscInt> constrained;  // particles that a triangle holds
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const std::array<PetscInt, 4> c = corners(i, j);
        for (std::size_t k = 0; k < 4; ++k) {
          if (triangles.count(4 * cell(i, j) + static_cast<PetscInt>(k)) == 0) {
            constrained.insert({c[k], c[(k + 1) % 4], lattice(i, j)});
          }
        }
      }
    }
    const auto sharing = springs();
    for (std::size_t colour = 0; colour < 4; ++colour) {
      for (const auto& [ids, around] : sharing[colour]) {
        if (std::includes(triangles.begin(), triangles.end(), around.begin(), around.end()) ||
            constrained.count(ids.first) == 0 || constrained.count(ids.second) == 0) {
          dead.springs[colour].insert(ids);
        }
      }
    }
    return dead;
  }
};

std::vector<double> burnt_at(const Sheet& sheet, const std::set<PetscInt>& burnt) {
  return level_by_id(sheet, [&burnt](PetscInt id) { return burnt.count(id) == 1 ? -0.1 : 0.2; });
}

/// Persistent ids of owned particles, from all ranks.
std::vector<PetscInt> ids_of(const Sheet& sheet, const std::vector<PetscInt>& particles) {
  std::vector<PetscInt> ids;
  for (const PetscInt i : particles) {
    ids.push_back(sheet.persistent_id[i]);
  }
  return gathered(sheet.comm(), ids);
}

std::vector<PetscInt> empty_ids(const Sheet& sheet, const ActiveSet& active) {
  const std::vector<bool> empty = empty_cells(sheet, active);
  EXPECT_EQ(static_cast<PetscInt>(empty.size()), sheet.elements.owned);
  std::vector<PetscInt> lattice;
  for (std::size_t c = 0; c < empty.size(); ++c) {
    if (empty[c]) {
      lattice.push_back(sheet.lattice[c]);
    }
  }
  return ids_of(sheet, lattice);
}

TEST(Ablation, LevelIsTheShareOfTheMassAboveTheLossMass) {
  const Sheet sheet = shell_of(grid_mesh(3, 2, 1));
  Field mass = initial_masses(sheet);
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    mass.data()[i] *= 1 - 0.01 * sheet.persistent_id[i];
  }
  const std::vector<double> level = level_set(sheet, mass, 0.3);
  ASSERT_EQ(level.size(), sheet.persistent_id.size());
  for (std::size_t i = 0; i < level.size(); ++i) {
    EXPECT_NEAR(level[i], 0.7 - 0.01 * sheet.persistent_id[i], 1e-14);
  }
}

TEST(Ablation, SpringsDieWithTheLastTriangleThatSharesThemOrHoldsAnEnd) {
  const Grid grid{6, 6};
  const Sheet sheet = shell_of(grid_mesh(6, 6, 1));
  ActiveSet active(sheet);
  // An L of burnt points in the middle, of which cell (3, 3) is not part, and the whole cell at the lower right.
  const std::set<PetscInt> burnt{grid.vertex(2, 2),  grid.vertex(2, 3),  grid.vertex(3, 3),  grid.vertex(4, 3),
                                 grid.lattice(2, 2), grid.lattice(3, 2), grid.lattice(2, 3), grid.vertex(5, 0),
                                 grid.vertex(6, 0),  grid.vertex(6, 1),  grid.vertex(5, 1),  grid.lattice(5, 0)};
  EXPECT_TRUE(burn_away(sheet, SpringRule::surface, active, burnt_at(sheet, burnt)));
  Dead dead;
  const PetscInt cell22 = 4 * grid.cell(2, 2);
  const PetscInt cell50 = 4 * grid.cell(5, 0);
  // The edge (2,3)-(3,3) from both sides, (3,3)-(4,3) from below, (2,2)-(2,3) from the right.
  dead.triangles = {cell22 + 2, cell22 + 3, 4 * grid.cell(2, 3), 4 * grid.cell(3, 2) + 2,
                    cell50,     cell50 + 1, cell50 + 2,          cell50 + 3};
  auto& [red, green, blue, yellow] = dead.springs;
  red = {{grid.vertex(2, 3), grid.lattice(2, 2)}};
  for (const PetscInt corner : grid.corners(5, 0)) {
    red.insert({corner, grid.lattice(5, 0)});
  }
  // Nothing is left of the surface at the lattice point of cell (5, 0), though beside it there is.
  green = {{grid.lattice(2, 2), grid.lattice(2, 3)},
           {grid.lattice(4, 0), grid.lattice(5, 0)},
           {grid.lattice(5, 0), grid.lattice(5, 1)}};
  blue = {{grid.vertex(2, 3), grid.vertex(3, 3)},
          {grid.vertex(5, 0), grid.vertex(6, 0)},
          {grid.vertex(6, 0), grid.vertex(6, 1)}};
  yellow = {{grid.vertex(5, 0), grid.vertex(6, 1)}, {grid.vertex(6, 0), grid.vertex(5, 1)}};
  expect_dead(sheet, active, dead);

  EXPECT_FALSE(burn_away(sheet, SpringRule::surface, active, burnt_at(sheet, burnt))) << "nothing more has burnt";
  // The corner of the sheet and the lattice point of its cell are constrained by nothing.
  Field mass = initial_masses(sheet);
  const std::vector<PetscInt> bare = bare_particles(sheet, active, mass);
  EXPECT_EQ(ids_of(sheet, bare), (std::vector<PetscInt>{grid.vertex(6, 0), grid.lattice(5, 0)}));
  for (const PetscInt i : bare) {
    mass.data()[i] = 0;
  }
  EXPECT_EQ(ids_of(sheet, bare_particles(sheet, active, mass)), std::vector<PetscInt>{});
  EXPECT_EQ(empty_ids(sheet, active), std::vector<PetscInt>{grid.lattice(5, 0)});
}

TEST(Ablation, CellsAreEmptyWhenTheirTrianglesHaveDied) {
  const Grid grid{6, 6};
  const Sheet sheet = shell_of(grid_mesh(6, 6, 1));
  ActiveSet active(sheet);
  std::set<PetscInt> burnt;
  for (int j = 1; j <= 4; ++j) {
    for (int i = 1; i <= 4; ++i) {
      burnt.insert(grid.vertex(i, j));
      if (i <= 3 && j <= 3) {
        burnt.insert(grid.lattice(i, j));
      }
    }
  }
  EXPECT_TRUE(burn_away(sheet, SpringRule::surface, active, burnt_at(sheet, burnt)));
  std::vector<PetscInt> empty;
  for (int j = 1; j <= 3; ++j) {
    for (int i = 1; i <= 3; ++i) {
      empty.push_back(grid.lattice(i, j));
    }
  }
  EXPECT_EQ(empty_ids(sheet, active), empty);
  std::vector<PetscInt> bare{grid.vertex(2, 2), grid.vertex(3, 2), grid.vertex(2, 3), grid.vertex(3, 3)};
  bare.insert(bare.end(), empty.begin(), empty.end());
  EXPECT_EQ(ids_of(sheet, bare_particles(sheet, active, initial_masses(sheet))), bare);
}

TEST(Ablation, WhatHasDiedStaysDead) {
  // Random level sets that rise and fall: a triangle is dead once its three points have burnt at the same time.
  const Grid grid{7, 5};
  const Sheet sheet = shell_of(grid_mesh(7, 5, 1));
  for (unsigned seed = 1; seed <= 5; ++seed) {
    ActiveSet active(sheet);
    std::mt19937 random(seed);
    std::set<PetscInt> triangles;
    for (int step = 0; step < 6; ++step) {
      std::vector<double> level(grid.lattice(6, 4) + 1);
      for (double& value : level) {
        value = std::uniform_real_distribution<double>(-1, 1.5)(random);
      }
      const auto has_burnt = [&level](PetscInt id) { return level[id] < 0; };
      const std::size_t before = triangles.size();
      for (int j = 0; j < 5; ++j) {
        for (int i = 0; i < 7; ++i) {
          const std::array<PetscInt, 4> corners = grid.corners(i, j);
          for (std::size_t k = 0; k < 4; ++k) {
            if (has_burnt(corners[k]) && has_burnt(corners[(k + 1) % 4]) && has_burnt(grid.lattice(i, j))) {
              triangles.insert(4 * grid.cell(i, j) + static_cast<PetscInt>(k));
            }
          }
        }
      }
      const bool died = burn_away(sheet, SpringRule::surface, active,
                                  level_by_id(sheet, [&level](PetscInt id) { return level[id]; }));
      EXPECT_EQ(died, triangles.size() > before);
      expect_dead(sheet, active, grid.dead(triangles));
    }
    EXPECT_GT(triangles.size(), 40U);
    EXPECT_LT(triangles.size(), 140U);
  }
}

TEST(Ablation, ACrackCutsTheSpringAcrossAndNothingElse) {
  // Every side between two cells, one at a time: the rank of its spring names it, and all ranks must see it.
  const Grid grid{4, 3};
  const Sheet sheet = shell_of(grid_mesh(4, 3, 1));
  const auto sharing = grid.springs();
  const SpringSet& blue = sheet.of(Colour::blue);
  int inner = 0;
  for (const auto& [ids, triangles] : sharing[2]) {
    if (triangles.size() < 2) {
      continue;
    }
    ++inner;
    std::vector<PetscInt> sides;
    for (PetscInt s = 0; s < blue.owned(); ++s) {
      if (ids_of(sheet, Colour::blue, s) == ids) {
        sides.push_back(s);
      }
    }
    ActiveSet active(sheet);
    EXPECT_TRUE(crack(sheet, SpringRule::surface, active, sides));
    Dead dead;
    for (const auto& [crossing, around] : sharing[1]) {
      if (around == triangles) {
        dead.springs[1].insert(crossing);
      }
    }
    EXPECT_EQ(dead.springs[1].size(), 1U);
    expect_dead(sheet, active, dead);
    for (std::size_t t = 0; t < active.cracked.size(); ++t) {
      EXPECT_EQ(active.cracked[t], triangles.count(id_of_triangle(sheet, t)) == 1);
    }
    // It follows from the flags of the cells.
    std::fill(active.springs[1].begin(), active.springs[1].end(), true);
    follow_triangles(sheet, SpringRule::surface, active);
    expect_dead(sheet, active, dead);
  }
  EXPECT_EQ(inner, 3 * 3 + 4 * 2);
  ActiveSet active(sheet);
  EXPECT_FALSE(crack(sheet, SpringRule::surface, active, {}));
  expect_dead(sheet, active, {});
}

TEST(Ablation, EverythingMayBurn) {
  const Sheet sheet = shell_of(grid_mesh(5, 4, 1));
  ActiveSet active(sheet);
  const std::vector<double> level(sheet.persistent_id.size(), -1e-9);
  EXPECT_TRUE(burn_away(sheet, SpringRule::surface, active, level));
  for (const std::vector<bool>& springs : active.springs) {
    EXPECT_EQ(std::count(springs.begin(), springs.end(), true), 0);
  }
  EXPECT_EQ(std::count(active.triangles.begin(), active.triangles.end(), true), 0);
  EXPECT_EQ(empty_ids(sheet, active).size(), 20U);
  EXPECT_EQ(static_cast<PetscInt>(bare_particles(sheet, active, initial_masses(sheet)).size()), sheet.particles.owned);
  EXPECT_FALSE(burn_away(sheet, SpringRule::surface, active, level));
}

}  // namespace
}  // namespace pellicle
