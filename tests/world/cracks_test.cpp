// Elastic sheets that are pulled apart: stress, cracks, corners that double, pieces.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "parallel/collective.h"
#include "tests/io/files.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/picture.h"
#include "tests/support/solver_options.h"
#include "tests/world/pulled_strip.h"

namespace pellicle::cracks_test {
namespace {

constexpr double width = 0.2;          // [m]
constexpr double length = 0.4;         // [m]
constexpr double stiffness = 5000;     // [N/m]
constexpr double strength = 100;       // [N/m]
constexpr double speed = 0.2;          // of the upper end [m/s]
constexpr double viscous_time = 2e-3;  // viscosity over stiffness [s]

/// A strip between x = 0 and `width`, y = 0 and `length`, constrained at its lower end and drawn out at its upper one.
Options pulled_strip() {
  Options options;
  options.dynamics = Dynamics::elastic;
  options.sheet.areal_density = 0.05;
  options.sheet.perturbation = 0;
  options.material.tensile_stiffness = stiffness;
  options.material.shear_stiffness = 0.375 * stiffness;
  options.material.bending_stiffness = 1e-3;
  options.material.damping = viscous_time;
  options.elastic.newton_tolerance = 1e-4;
  options.force.gravity = {0, 0, 0};
  options.force.damping = 0;
  options.ablation.strength = strength;
  options.pins["lower"].box = {-1, -1, -1, 1, 1e-6, 1};
  options.pins["upper"].box = {-1, length - 1e-6, -1, 1, 1, 1};
  options.pins["upper"].velocity = {0, speed, 0};
  options.output.name = "strip";
  return options;
}

SurfaceMesh strip_mesh(int cells) { return grid_mesh(cells, 2 * cells, width / cells); }

/// A picture that is black half-way up and white at both ends. Collective. @returns its path
std::string weak_middle(const TestFolder& folder) {
  return write_picture(folder, 1, 3, [](int, int row) { return row == 1 ? 0 : 255; });
}

/// A run of a strip in steps of one length.
class Pulled : public PulledStrip {
 public:
  using PulledStrip::PulledStrip;

  /// Undeformed middles of the cracked sides.
  std::vector<std::array<double, 2>> cracks() {
    std::vector<std::array<double, 2>> own;
    for (PetscInt t = 0; t < 4 * surface().elements.owned; ++t) {
      if (fields().active.cracked[t]) {
        const auto& corners = surface().cells[t / 4];
        const Eigen::Vector3d middle =
            (surface().rest.col(corners[t % 4]) + surface().rest.col(corners[(t + 1) % 4])) / 2;
        own.push_back({middle.x(), middle.y()});
      }
    }
    std::vector<std::array<double, 2>> all = of_all_ranks(surface().comm(), own);  // each from both of its cells
    std::sort(all.begin(), all.end());
    return all;
  }
};

TEST(Cracks, PartAStripAcrossWhereItIsWeak) {
  const TestFolder folder;
  Options options = pulled_strip();
  options.output.directory = folder / "out";
  options.ablation.strength_texture = weak_middle(folder);
  options.ablation.strength_range = {0.5, 1};
  constexpr int cells = 6;
  Pulled run(strip_mesh(cells), options, 1e-3);
  const PetscInt particles = run.surface().particles.global;
  const double mass = run.mass();
  const double begin = run.first_crack(0.1);
  for (int k = 0; k < 20; ++k) {
    run.step();
  }

  EXPECT_EQ(run.cracked_sides(), cells);
  EXPECT_NEAR(run.sum(run.fields().crack_length), width, 1e-12);
  for (const auto& [x, y] : run.cracks()) {
    EXPECT_NEAR(y, length / 2, 1e-12);
  }
  EXPECT_EQ(run.surface().particles.global, particles + cells + 1);
  EXPECT_EQ(run.surface().elements.global, 2 * cells * cells) << "no cell is lost";
  const std::vector<PetscInt> ids = run.ids();
  EXPECT_EQ(std::set<PetscInt>(ids.begin(), ids.end()).size(), ids.size());
  EXPECT_EQ(*std::max_element(ids.begin(), ids.end()), particles + cells) << "new ids follow on the old ones";
  EXPECT_NEAR(run.mass(), mass, 1e-14 * mass);
  EXPECT_NEAR(run.initial_mass(), mass, 1e-14 * mass);
  EXPECT_EQ(run.sum(run.fields().mass_burnt), 0);
  const std::vector<double>& burnt = run.fields().burn_time;
  EXPECT_TRUE(std::all_of(burnt.begin(), burnt.end(), [](double time) { return time == -1; }));

  run.expect_halves(mass, length, begin - 1e-12, begin + 0.01, speed * run.time(), 0.1);
  expect_crack_in_history(folder / "out", cells, width);
}

// Its ends are pushed back together behind the crack, by more than the way on which they were drawn apart.
TEST(Cracks, HaveLipsThatCloseAndDoNotPassThroughEachOther) {
  const TestFolder folder;
  Options options = pulled_strip();
  options.output.directory = folder / "out";
  options.sheet.perturbation = 0.02;
  options.ablation.strength_texture = weak_middle(folder);
  options.ablation.strength_range = {0.5, 1};
  options.contact.self = true;
  options.contact.check = true;
  options.contact.thickness = 5e-3;
  options.pins["upper"].velocity = {0, 0, 0};
  options.pins["upper"].path = Rows{{0, 0, 0, 0}, {0.03, 0, 6e-3, 0}, {0.13, 0, -2e-3, 0}};
  Pulled run(strip_mesh(6), options, 5e-4);
  for (int n = 0; n < 260; ++n) {
    run.step();
    ASSERT_FALSE(::testing::Test::HasFatalFailure()) << "step " << n;
  }
  EXPECT_EQ(run.cracked_sides(), 6);
  MPI_Barrier(PETSC_COMM_WORLD);
  const auto history = read_csv(options.output.directory + "/history.csv");
  EXPECT_EQ(*std::max_element(history.at("crossings").begin(), history.at("crossings").end()), 0);
  const std::vector<double>& contacts = history.at("self_contacts");
  EXPECT_GT(*std::max_element(contacts.begin() + 200, contacts.end()), 0) << "when the lips have come together";
  const std::vector<double>& gaps = history.at("smallest_gap");
  EXPECT_LT(*std::min_element(gaps.begin(), gaps.end()), 0.5 * 5e-3) << "they press";
}

/// When a strip cracks first [s].
double cracking_time(const TestFolder& folder, int cells, double h) {
  Options options = pulled_strip();
  options.output.directory = folder / (std::to_string(cells) + "_" + std::to_string(h));
  options.ablation.strength_texture = weak_middle(folder);  // so that it cracks far from its ends, where stress is even
  options.ablation.strength_range = {0.5, 1};
  Pulled run(strip_mesh(cells), options, h);
  return run.first_crack(0.1);
}

TEST(Cracks, BeginAtTheStrengthWhateverMeshAndStep) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  const TestFolder folder;
  // By then the strip's strain is strength / stiffness, less what viscosity bears.
  const double expected = 0.5 * strength / stiffness * length / speed - viscous_time;
  for (const auto& [cells, h] : {std::pair{4, 1e-3}, {8, 1e-3}, {12, 1e-3}, {8, 5e-4}, {8, 2e-3}}) {
    EXPECT_NEAR(cracking_time(folder, cells, h), expected, 0.03 * expected + h) << cells << " cells, " << h << " s";
  }
}

/// The strip with a slit from its left side half-way up.
SurfaceMesh notched(int cells, int cut) {
  SurfaceMesh mesh = strip_mesh(cells);
  std::vector<int> copy(mesh.points.size(), -1);
  for (int i = 0; i < cut; ++i) {
    const int vertex = cells * (cells + 1) + i;
    copy[vertex] = static_cast<int>(mesh.points.size());
    mesh.points.push_back(mesh.points[vertex]);
  }
  for (std::size_t face = static_cast<std::size_t>(cells * cells); face < mesh.faces.size(); ++face) {
    for (int& corner : mesh.faces[face]) {
      const auto k = static_cast<std::size_t>(corner);
      corner = k < copy.size() && copy[k] >= 0 ? copy[k] : corner;
    }
  }
  return mesh;
}

/// The stress at which a strip cracks first that is not weaker anywhere, as a fraction of the strength.
/// @param notch the part of its width to which it is slit
double share_at_first_crack(const TestFolder& folder, int cells, double notch, double averaged_over) {
  Options options = pulled_strip();
  options.output.directory = folder / (std::to_string(cells) + "_" + std::to_string(notch + averaged_over));
  options.ablation.strength_length = averaged_over;
  Pulled run(notched(cells, static_cast<int>(std::lround(notch * cells))), options, 1e-3);
  return run.first_crack(0.1) * speed / length * stiffness / strength;
}

// The stress at the corners of its clamps, and much more at the tip of a slit, is the greater the finer the mesh.
TEST(Cracks, BeginAtClampsAndNotchesUnderALoadThatDoesNotDependOnTheMesh) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  const TestFolder folder;
  constexpr double averaged_over = 0.04;  // [m]
  const double clamped = share_at_first_crack(folder, 6, 0, averaged_over);
  EXPECT_NEAR(share_at_first_crack(folder, 12, 0, averaged_over), clamped, 0.03 * clamped);
  EXPECT_LT(clamped, 1);
  const double slit = share_at_first_crack(folder, 6, 0.5, averaged_over);
  EXPECT_NEAR(share_at_first_crack(folder, 12, 0.5, averaged_over), slit, 0.06 * slit);
  EXPECT_LT(slit, 0.85 * clamped);
  EXPECT_LT(share_at_first_crack(folder, 12, 0.5, 0), 0.8 * share_at_first_crack(folder, 6, 0.5, 0)) << "not averaged";
}

TEST(Cracks, RunOnFromANotch) {
  const TestFolder folder;
  Options options = pulled_strip();
  options.output.directory = folder / "out";
  constexpr int cells = 8;
  constexpr int cut = 3;
  constexpr double edge = width / cells;
  Pulled run(notched(cells, cut), options, 1e-3);
  const PetscInt particles = run.surface().particles.global;
  const double begin = run.first_crack(0.1);
  const std::vector<std::array<double, 2>> first = run.cracks();
  ASSERT_EQ(first.size(), 2U) << "one side, of two cells";
  EXPECT_NEAR(first[0][0], (cut + 0.5) * edge, 1e-12) << "at the tip";
  EXPECT_NEAR(first[0][1], length / 2, 1e-12);
  EXPECT_LT(begin, 0.8 * strength / stiffness * length / speed) << "sooner than without a notch";
  EXPECT_EQ(run.surface().particles.global, particles + 1) << "the tip opens";
  while (run.fields().pieces.present.size() == 1 && run.time() < begin + 0.02) {
    run.step();
  }
  EXPECT_EQ(run.fields().pieces.present.size(), 2U);
  EXPECT_EQ(run.cracked_sides(), cells - cut) << "straight across";
  for (const auto& [x, y] : run.cracks()) {
    EXPECT_NEAR(y, length / 2, 1e-12);
  }
}

}  // namespace
}  // namespace pellicle::cracks_test
