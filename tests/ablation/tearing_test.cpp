#include "ablation/tearing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/ablation/sheets.h"

namespace pellicle {
namespace {

constexpr double h = 0.01;  // [s]
constexpr double min_mass = 0.4;

/// A sheet with all that tearing reads: at rest, unburnt, free until a test changes it.
struct TearScene {
  explicit TearScene(MPI_Comm comm, int cells = 4)
      : sheet(shell_of(grid_mesh(cells, cells, 0.5), comm)), living(sheet), mass(sheet.particles, 1) {
    sheet.initial_mass.assign(sheet.initial_mass.size(), 0.2);
    mass.values().setConstant(0.2);
    pinned.assign(sheet.initial_mass.size(), false);
    for (std::size_t colour = 0; colour < 4; ++colour) {
      pull[colour].assign(static_cast<std::size_t>(sheet.springs[colour].owned()), 0);
    }
  }
  TearScene(const TearScene&) = delete;
  TearScene& operator=(const TearScene&) = delete;

  TearingInput input() const { return {living, pull, mass, pinned, h, min_mass}; }

  Sheet sheet;
  Living living;
  std::array<std::vector<double>, 4> pull;
  Field mass;
  std::vector<bool> pinned;
};

AblationOptions strength_100() {
  AblationOptions options;
  options.strength = 100;
  return options;
}

/// The pull at which the blue spring between the particles 0 and 1, of length 0.5 m, tears. One rank.
double threshold(TearScene& scene, const std::vector<double>& texture = {}) {
  const Tearing tearing(scene.sheet, strength_100(), texture);
  const SpringSet& blue = scene.sheet.of(Colour::blue);
  PetscInt spring = 0;
  while (ids_of(scene.sheet, Colour::blue, spring) != IdPair(0, 1)) {
    ++spring;
  }
  EXPECT_NEAR(blue.initial_length[static_cast<std::size_t>(spring)], 0.5, 1e-15);
  double below = 0;
  double above = 1;
  for (int k = 0; k < 60; ++k) {
    const double middle = (below + above) / 2;
    scene.pull[2][static_cast<std::size_t>(spring)] = middle;
    const auto torn = tearing.torn(scene.input());
    EXPECT_EQ(torn[0].size() + torn[1].size() + torn[3].size(), 0U);
    if (torn[2].empty()) {
      below = middle;
    } else {
      EXPECT_EQ(torn[2], std::vector<PetscInt>{spring});
      above = middle;
    }
  }
  return above;
}

TEST(Tearing, threshold_is_the_strength_of_what_is_left) {
  // 100 N/m times 0.5 m: 50 N, that is 50 N h^2 (2/0.2 kg) = 0.05 m.
  TearScene scene(PETSC_COMM_SELF);
  EXPECT_NEAR(threshold(scene), 0.05, 1e-14);
  std::vector<double> texture(scene.pinned.size(), 7);
  texture[0] = 0.5;
  texture[1] = 1;
  EXPECT_NEAR(threshold(scene, texture), 0.75 * 0.05, 1e-14);

  scene.pinned[1] = true;
  EXPECT_NEAR(threshold(scene), 0.025, 1e-14);
  scene.pinned[0] = true;
  EXPECT_EQ(threshold(scene), 1) << "nothing moves either end";
  scene.pinned.assign(scene.pinned.size(), false);

  // A tenth of the strength is left at the least mass, 0.55 at half of the way, at one end or at both.
  const double lightest = 0.2 * min_mass;
  const double half = 0.2 * (1 + min_mass) / 2;
  for (const auto& [a, b, left] : {std::tuple{0.2, lightest, 0.55},
                                   {lightest, lightest, 0.1},
                                   {half, half, 0.55},
                                   {half, 0.2, 0.775},
                                   {lightest / 2, lightest, 0.1}}) {
    scene.mass.data()[0] = a;
    scene.mass.data()[1] = b;
    EXPECT_NEAR(threshold(scene), left * 50 * h * h * (1 / a + 1 / b), 1e-14) << a << " " << b;
  }
  scene.mass.values().setConstant(0.2);

  scene.living.springs[2].assign(scene.living.springs[2].size(), false);
  EXPECT_EQ(threshold(scene), 1) << "dead springs do not tear";
}

TEST(Tearing, springs_that_push_do_not_tear) {
  TearScene scene(PETSC_COMM_WORLD);
  for (auto& pulls : scene.pull) {
    pulls.assign(pulls.size(), -1);
  }
  for (const auto& torn : Tearing(scene.sheet, strength_100(), {}).torn(scene.input())) {
    EXPECT_TRUE(torn.empty());
  }
}

/// By the ids of their ends, the share above which each owned spring's pull of 50 N/0.5 m times its length tears it, in
/// steps of 0.001.
std::map<IdPair, double> shares(MPI_Comm comm, int seed) {
  TearScene scene(comm, 12);
  AblationOptions options = strength_100();
  options.strength_scatter = 0.4;
  options.seed = seed;
  const Tearing tearing(scene.sheet, options, {});
  std::map<IdPair, double> result;
  for (double share = 0.55; share <= 1.45; share += 0.001) {
    for (std::size_t colour = 0; colour < 4; ++colour) {
      for (std::size_t s = 0; s < scene.pull[colour].size(); ++s) {
        scene.pull[colour][s] = share * 100 * scene.sheet.springs[colour].initial_length[s] * h * h * 10;
      }
    }
    const auto torn = tearing.torn(scene.input());
    for (const Colour colour : all_colours) {
      for (const PetscInt spring : torn[static_cast<std::size_t>(colour)]) {
        result.try_emplace(ids_of(scene.sheet, colour, spring), share);
      }
    }
  }
  std::size_t springs = 0;
  for (const SpringSet& set : scene.sheet.springs) {
    springs += static_cast<std::size_t>(set.owned());
  }
  EXPECT_EQ(result.size(), springs) << "all tear in the end";
  return result;
}

TEST(Tearing, scatter_is_uniform_and_depends_on_seed_and_ids_alone) {
  const std::map<IdPair, double> alone = shares(PETSC_COMM_SELF, 3);
  double sum = 0;
  double squares = 0;
  for (const auto& [ids, share] : alone) {
    EXPECT_GE(share, 0.6 - 1e-9);
    EXPECT_LE(share, 1.4 + 1.1e-3);
    const double u = (share - 0.0005 - 1) / 0.4;
    sum += u;
    squares += u * u;
  }
  // Uniform in [-1, 1]: mean 0 and variance 1/3, within three standard deviations.
  const auto count = static_cast<double>(alone.size());
  EXPECT_NEAR(sum / count, 0, 3 * std::sqrt(1 / 3.0 / count));
  EXPECT_NEAR(squares / count, 1 / 3.0, 3 * std::sqrt((1 / 5.0 - 1 / 9.0) / count));

  for (const auto& [ids, share] : shares(PETSC_COMM_WORLD, 3)) {
    EXPECT_EQ(share, alone.at(ids)) << ids.first << ' ' << ids.second;
  }
  double difference = 0;
  for (const auto& [ids, share] : shares(PETSC_COMM_SELF, 4)) {
    difference += std::abs(share - alone.at(ids)) / 0.4;
  }
  EXPECT_NEAR(difference / count, 2 / 3.0, 0.1) << "the mean distance of two uniform numbers";
}

}  // namespace
}  // namespace pellicle
