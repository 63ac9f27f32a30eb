// Walls that are pulled apart: cracks along the sides of elements, vertices that double, pieces.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "base/error.h"
#include "parallel/collective.h"
#include "tests/io/files.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/picture.h"
#include "tests/support/solver_options.h"
#include "tests/world/pulled_strip.h"

namespace pellicle::wall_cracks_test {
namespace {

constexpr double width = 0.1;       // [m]
constexpr double length = 0.2;      // [m]
constexpr double thickness = 1e-3;  // [m]
constexpr double mu = 0.4e6;        // [Pa]
constexpr double strength = 200;    // half-way up [N/m]

/// A strip of rubber between x = 0 and `width`, y = 0 and `length`, that is half as strong half-way up as elsewhere.
/// Collective.
Options strip(const TestFolder& folder, const std::string& name) {
  Options options;
  options.chain = ChainKind::inflate;
  options.wall.thickness = thickness;
  options.wall.material.mu = mu;
  options.prism.mass_damping = 20;
  options.force.gravity.setZero();
  options.ablation.strength = 2 * strength;
  options.ablation.strength_texture = write_picture(folder, 1, 3, [](int, int row) { return row == 1 ? 0 : 255; });
  options.ablation.strength_range = {0.5, 1};
  options.output.directory = folder / name;
  options.output.name = "strip";
  return options;
}

/// The right half is the mirror image of the left one.
SurfaceMesh strip_mesh(int cells) {
  SurfaceMesh mesh = grid_mesh(cells, 2 * cells, width / cells);
  mesh.groups["middle"] = {cells * (cells + 1)};  // the left vertex half-way up
  const SurfaceMesh quads = mesh;
  mesh.faces.clear();
  mesh.uv.clear();
  for (std::size_t quad = 0; quad < quads.faces.size(); ++quad) {
    const std::size_t first = static_cast<int>(quad) % cells < cells / 2 ? 0 : 1;  // corner of the diagonal
    for (const std::size_t k : {first, first + 2}) {
      const auto corner = [&](std::size_t turn) { return (k + turn) % 4; };
      mesh.faces.push_back({quads.faces[quad][corner(0)], quads.faces[quad][corner(1)], quads.faces[quad][corner(2)]});
      mesh.uv.push_back({quads.uv[quad][corner(0)], quads.uv[quad][corner(1)], quads.uv[quad][corner(2)]});
    }
  }
  return mesh;
}

/// A run in steps of one length.
class Pulled : public PulledStrip {
 public:
  Pulled(int cells, const Options& options, double h)
      : PulledStrip(strip_mesh(cells), options, h, ChainKind::inflate) {}

  /// Undeformed heights of the ends of all cracked sides of elements.
  std::vector<double> heights() {
    std::vector<double> own;
    for (PetscInt side = 0; side < 3 * surface().elements.owned; ++side) {
      if (fields().active.cracked[side]) {
        own.push_back(surface().rest(1, surface().corner(side / 3, side % 3)));
        own.push_back(surface().rest(1, surface().corner(side / 3, side % 3 + 1)));
      }
    }
    return of_all_ranks(PETSC_COMM_WORLD, own);
  }
};

TEST(WallCracks, PartAStripAcrossWhereItIsWeak) {
  const TestFolder folder;
  Options options = strip(folder, "out");
  options.pins["lower"].box = {-1, -1, -1, 1, 1e-6, 1};
  options.pins["upper"].box = {-1, length - 1e-6, -1, 1, 1, 1};
  constexpr double speed = 0.1;
  options.prism.mass_damping = 100;
  options.prism.stiffness_damping = 5e-3;  // so that the halves do not fold as they spring back
  options.ablation.strength_range = {0.3, 1};
  options.pins["upper"].velocity = {0, speed, 0};
  options.forces["nudge"].group = "middle";
  options.forces["nudge"].force = {{0, 0, 0, 1e-3}};
  constexpr int cells = 6;
  Pulled run(cells, options, 2e-3);
  const PetscInt vertices = run.surface().particles.global;
  const PetscInt elements = run.surface().elements.global;
  const double mass = run.mass();
  const double begin = run.first_crack(0.5);
  for (int k = 0; k < 60; ++k) {
    run.step();
  }

  EXPECT_EQ(run.cracked_sides(), cells);
  EXPECT_NEAR(run.sum(run.fields().crack_length), width, 1e-12);
  for (const double y : run.heights()) {
    EXPECT_NEAR(y, length / 2, 1e-12);
  }
  EXPECT_EQ(run.surface().particles.global, vertices + cells + 1);
  EXPECT_EQ(run.surface().elements.global, elements) << "no element is lost";
  const std::vector<bool>& active = run.fields().active.triangles;
  EXPECT_TRUE(std::all_of(active.begin(), active.end(), [](bool lives) { return lives; }));
  const std::vector<PetscInt> ids = run.ids();
  EXPECT_EQ(std::set<PetscInt>(ids.begin(), ids.end()).size(), ids.size());
  EXPECT_EQ(*std::max_element(ids.begin(), ids.end()), vertices + cells) << "new ids follow on the old ones";
  EXPECT_NEAR(run.mass(), mass, 1e-14 * mass);
  EXPECT_NEAR(run.initial_mass(), mass, 1e-14 * mass);
  EXPECT_EQ(run.sum(run.fields().mass_burnt), 0);
  const std::vector<double>& burnt = run.fields().burn_time;
  EXPECT_TRUE(std::all_of(burnt.begin(), burnt.end(), [](double time) { return time == -1; }));
  const std::vector<PetscInt> pins = run.all_of(run.state().pin);
  EXPECT_EQ(std::count(pins.begin(), pins.end(), 0), cells + 1);
  EXPECT_EQ(std::count(pins.begin(), pins.end(), 1), cells + 1);
  const std::vector<bool>& loads = *run.state().loads;
  EXPECT_EQ(
      run.sum(static_cast<double>(std::count(loads.begin(), loads.begin() + run.surface().particles.owned, true))), 2)
      << "the vertex that is pushed and its copy";

  run.expect_halves(mass, length, begin - 1e-12, begin + 0.02, speed * run.time(), 0.2);
  expect_crack_in_history(folder / "out", cells, width);
}

/// When a strip cracks first that is pulled by a force which grows by `rate` [s].
/// @param stress that it withstands half-way up, in place of a force per width [Pa]; 0: none
double cracking_time(const TestFolder& folder, int cells, double h, double rate, double stress = 0) {
  Options options = strip(folder, std::to_string(cells) + "_" + std::to_string(h) + "_" + std::to_string(stress));
  if (stress > 0) {
    options.ablation.strength.reset();
    options.wall.strength = 2 * stress;
  }
  options.prism.inertia = false;
  options.symmetry["lower"].normal = {0, 1, 0};
  options.forces["upper"].box = {-1, length - 1e-6, -1, 1, 1, 1};
  options.forces["upper"].force = {{0, 0, 0, 0}, {1, 0, rate, 0}};
  Pulled run(cells, options, h);
  return run.first_crack(1);
}

TEST(WallCracks, BeginWhereTheTensionReachesTheStrengthWhateverMeshAndStep) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  const TestFolder folder;
  // A strip that is stretched by c bears mu (c - 1/c^2) of force per undeformed section, and is narrower by c^(-1/2).
  const auto tension = [](double c) { return mu * thickness * (c - 1 / (c * c)) * std::sqrt(c); };
  double low = 1;
  double high = 2;
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    (tension(middle) < strength ? low : high) = middle;
  }
  constexpr double rate = 20;  // [N/s]
  const double expected = strength * width / std::sqrt(low) / rate;
  ASSERT_LT(expected, 0.98);
  for (const auto& [cells, h] : {std::pair{4, 0.02}, {8, 0.02}, {8, 0.01}, {12, 0.01}}) {
    EXPECT_NEAR(cracking_time(folder, cells, h, rate), expected + h / 2, 0.003 * expected + h / 2)
        << cells << " cells, " << h << " s";
  }
}

TEST(WallCracks, AStrengthInPascalIsThatOfTheStressInTheWallAsThinAsItHasBecome) {
  // mu (c^2 - 1/c) = 0.2 MPa at a stretch of c = 1.16537.
  const TestFolder folder;
  constexpr double c = 1.16537;
  constexpr double rate = 20;  // [N/s]
  constexpr double h = 0.01;   // [s]
  constexpr double stress = 0.2e6;
  ASSERT_NEAR(mu * (c * c - 1 / c), stress, 1e-4 * stress);
  const double expected = mu * thickness * width * (c - 1 / (c * c)) / rate;
  EXPECT_NEAR(cracking_time(folder, 4, h, rate, stress), expected + h / 2, 0.003 * expected + h / 2);

  Options both = strip(folder, "both");
  both.wall.strength = stress;
  EXPECT_THROW(cracks_of(both), Error);
}

}  // namespace
}  // namespace pellicle::wall_cracks_test
