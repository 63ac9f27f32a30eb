#include "projection/successive_projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/error.h"
#include "tests/projection/sheets.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

std::string name_of(Colour colour) { return colour_names[static_cast<std::size_t>(colour)]; }

/// All kinds of Gram matrix, that of the default included.
std::vector<std::string> mat_types() { return {"aij", "sell", "shell", ProjectOptions{}.mat_type.name()}; }

/// A flat grid of square cells, side 1, with some noise.
Sheet grid_sheet(int cells, double thickness_per_cell) {
  SheetOptions options;
  options.thickness = thickness_per_cell / cells;
  return make_sheet(PETSC_COMM_WORLD, grid_mesh(cells, cells, 1.0 / cells), options);
}

void perturb(Scene& scene, double share_of_edge) {
  SheetOptions options;
  options.perturbation = share_of_edge;
  scene.x.values() = perturbed_positions(scene.sheet, options);
}

/// Sum over all owned particles of all ranks. Collective.
Eigen::Vector3d sum_over_particles(const Sheet& sheet, const std::function<Eigen::Vector3d(PetscInt)>& value) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    sum += value(i);
  }
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, sheet.comm());
  return sum;
}

// Table 1: a particle between two fixed ones, a green spring of target 1.65 to the left, a blue one of 0.55 to the
// right.

struct TwoSprings : Scene {
  TwoSprings()
      : Scene(hand_made_sheet((Eigen::Matrix3Xd(3, 3) << -1, 0, 1, 0, 0, 0, 0, 0, 0).finished(),
                              {{Colour::green, {{0, 1}}}, {Colour::blue, {{1, 2}}}})) {
    pinned = {true, false, true};
    scale_targets(Colour::green, 1.65);
    scale_targets(Colour::blue, 0.55);
  }
};

TEST(SuccessiveProjection, Table1) {
  TwoSprings scene;
  ProjectOptions options = tight_options();
  options.pins = "paper";
  SuccessiveProjection projection(scene.sheet, options);
  const std::array<std::array<double, 2>, 5> expected{
      {{0.4306, 0.4401}, {0.5527, 0.4955}, {0.5767, 0.5039}, {0.5805, 0.5051}, {0.5810, 0.5053}}};
  const std::array<std::array<double, 2>, 5> printed{
      {{0.4306, 0.4401}, {0.5527, 0.4954}, {0.5767, 0.5038}, {0.5804, 0.5050}, {0.5810, 0.5052}}};
  for (std::size_t step = 0; step < expected.size(); ++step) {
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_TRUE(projection.project(scene.x, k == 0 ? Colour::green : Colour::blue, scene.input()).converged);
      const double p = scene.x.vector(1)[0];
      EXPECT_NEAR(p, expected[step][k], 1e-4) << "step " << step + 1;
      EXPECT_NEAR(p, printed[step][k], 1.5e-4) << "step " << step + 1;
      EXPECT_EQ(scene.x.vector(1).tail<2>().norm(), 0);
    }
  }
  EXPECT_EQ(scene.x.vector(0), Eigen::Vector3d(-1, 0, 0));
  EXPECT_EQ(scene.x.vector(2), Eigen::Vector3d(1, 0, 0));

  // The five steps in one call.
  TwoSprings again;
  options.max_steps = 5;
  SuccessiveProjection successive(again.sheet, options);
  EXPECT_TRUE(successive.advance(again.x, again.input()).converged);
  EXPECT_DOUBLE_EQ(again.x.vector(1)[0], scene.x.vector(1)[0]);
}

TEST(SuccessiveProjection, ExactPinsAreNewtonsMethodForOneLength) {
  TwoSprings scene;
  SuccessiveProjection projection(scene.sheet, tight_options());
  // With both ends but one at rest a projection is d -> (d + l^2/d)/2: twice the paper's first step, and far apart
  // then: 0.8613, -0.1595 after the first step, 1.0398, 4.8204 after the second; the two springs do not settle.
  double p = 0;
  for (int step = 1; step <= 2; ++step) {
    for (const auto& [colour, end, length] : {std::tuple{Colour::green, -1.0, 1.65}, {Colour::blue, 1.0, 0.55}}) {
      const double d = p - end;
      p = end + (d + length * length / d) / 2;
      EXPECT_TRUE(projection.project(scene.x, colour, scene.input()).converged);
      EXPECT_NEAR(scene.x.vector(1)[0], p, 1e-10);
      if (step == 1) {
        EXPECT_NEAR(p, colour == Colour::green ? 0.8613 : -0.1595, 1e-4);
      }
    }
  }
  // One spring alone is solved to rounding.
  TwoSprings alone;
  for (int step = 0; step < 6; ++step) {
    EXPECT_TRUE(projection.project(alone.x, Colour::green, alone.input()).converged);
  }
  EXPECT_NEAR(alone.x.vector(1)[0], 0.65, 1e-14);
}

// Fig. 8.

TEST(SuccessiveProjection, TotalErrorFallsAfterEachStep) {
  Scene scene(grid_sheet(12, 0.25));
  perturb(scene, 0.01);
  scene.scale_targets(Colour::blue, 0.99);
  ProjectOptions options = tight_options();
  options.max_steps = 9;
  options.monitor = true;
  SuccessiveProjection projection(scene.sheet, options);
  EXPECT_TRUE(projection.advance(scene.x, scene.input()).converged);
  const auto& curve = projection.monitored();
  ASSERT_EQ(curve.size(), 1 + 4 * 9U);
  std::vector<double> total;
  for (const ProjectionError& error : curve) {
    if (error.step > 0 && error.projected == Colour::yellow) {
      total.push_back(error.total);
    }
  }
  for (std::size_t step = 1; step < total.size(); ++step) {
    EXPECT_LT(total[step], total[step - 1]) << "step " << step + 1;
  }
}

class OneColour : public ::testing::TestWithParam<Colour> {};
INSTANTIATE_TEST_SUITE_P(all, OneColour, ::testing::ValuesIn(all_colours),
                         [](const auto& info) { return name_of(info.param); });

TEST_P(OneColour, ConvergesQuadratically) {
  const Colour colour = GetParam();
  for (const double noise : {0.0, 0.02}) {
    Scene scene(grid_sheet(10, 0.5));
    perturb(scene, noise);
    scene.scale_targets(colour, 0.99);
    SuccessiveProjection projection(scene.sheet, tight_options());
    const auto error = [&] {
      return projection.errors(scene.x, scene.input()).colour[static_cast<std::size_t>(colour)];
    };
    double before = error();
    const double rounding = 1e-13;
    for (int step = 1; before > rounding; ++step) {
      ASSERT_LE(step, 4) << "noise " << noise;
      EXPECT_TRUE(projection.project(scene.x, colour, scene.input()).converged);
      const double after = error();
      // 1/m: the neglected term is |dx_a - dx_b|^2/l. Measured: 0.12 to 1.2.
      EXPECT_LE(after, 2 * before * before + rounding) << "step " << step << ", noise " << noise;
      EXPECT_LE(after, before / (step == 1 ? 30 : 100) + rounding) << "step " << step << ", noise " << noise;
      before = after;
    }
  }
}

// Momentum: J^T lambda pulls at both ends alike and along the spring, whatever lambda is.

class Momentum : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(masses, Momentum, ::testing::Values("equal", "true"),
                         [](const auto& info) { return info.param; });

TEST_P(Momentum, IsKeptByAFreeProjection) {
  ProjectOptions options;  // as users have them: shift, loose inner tolerance
  options.masses = GetParam();
  double last_turn = 0;
  for (const double shrinkage : {0.02, 0.002}) {
    Scene scene(grid_sheet(8, 0.5));
    scene.scale_targets(Colour::blue, 1 - shrinkage);
    scene.scale_targets(Colour::green, 1 - shrinkage / 3);
    if (GetParam() == "true") {
      for (std::size_t i = 0; i < scene.mass.size(); ++i) {
        scene.mass[i] *= 0.3 + 0.1 * static_cast<double>(scene.sheet.persistent_id[i] % 8);
      }
    } else {
      scene.mass.assign(scene.mass.size(), 1.0);
    }
    // A sheet that is not symmetric: wrinkled in proportion to the shrinkage.
    perturb(scene, shrinkage);
    SuccessiveProjection projection(scene.sheet, options);
    const Eigen::MatrixXd start = scene.x.values();
    double path = 0;  // sum of the norms of the colours' displacements, by sqrt(m)
    double all_mass = 0;
    double smallest = 0;  // rounding of the sums: mass times largest displacement
    for (int step = 0; step < 5; ++step) {
      for (const Colour colour : all_colours) {
        const Eigen::MatrixXd before = scene.x.values();
        EXPECT_TRUE(projection.project(scene.x, colour, scene.input()).converged);
        const auto moved = [&](PetscInt i) { return Eigen::Vector3d(scene.x.values().col(i) - before.col(i)); };
        const auto mass = [&](PetscInt i) { return scene.mass[i]; };
        const Eigen::Vector3d linear =
            sum_over_particles(scene.sheet, [&](PetscInt i) { return Eigen::Vector3d(mass(i) * moved(i)); });
        const Eigen::Vector3d angular = sum_over_particles(scene.sheet, [&](PetscInt i) {
          return Eigen::Vector3d(mass(i) * Eigen::Vector3d(before.col(i)).cross(moved(i)));
        });
        all_mass = sum_over_particles(scene.sheet, [&](PetscInt i) { return Eigen::Vector3d(mass(i), 0, 0); })[0];
        const double squared_norm = sum_over_particles(
            scene.sheet, [&](PetscInt i) { return Eigen::Vector3d(mass(i) * moved(i).squaredNorm(), 0, 0); })[0];
        path += std::sqrt(squared_norm);
        smallest = 1e-15 * all_mass;
        // One colour turns nothing at all: the pull is along the spring from where it started.
        EXPECT_LE(linear.norm(), smallest) << name_of(colour);
        EXPECT_LE(angular.norm(), 2 * smallest) << name_of(colour);
      }
    }
    // All together from where the step began, as the velocity update (eq. 13) sees it: sum of m x0 x (d1 + d2 + ...).
    // Each d_k pulls from x_{k-1} = x0 + d1 + ... + d_{k-1}, so the sum is at most (|d1| + |d2| + ...)^2 by Cauchy and
    // Schwarz: second order in the constraint error.
    const Eigen::Vector3d turned = sum_over_particles(scene.sheet, [&](PetscInt i) {
      return Eigen::Vector3d(
          scene.mass[i] * Eigen::Vector3d(start.col(i)).cross(Eigen::Vector3d(scene.x.values().col(i) - start.col(i))));
    });
    EXPECT_LE(turned.norm(), path * path + 20 * smallest);
    EXPECT_LE(path * path, all_mass * shrinkage);  // The bound itself is small.
    if (last_turn > 0) {
      EXPECT_LE(turned.norm(), last_turn / 10);
    }
    last_turn = turned.norm();
    print_once("momentum, %s masses, shrinkage %g: turned %g, bound %g\n", GetParam().c_str(), shrinkage, turned.norm(),
               path * path);
  }
}

// Kinds of matrix, pins, shift, singular systems.

SurfaceMesh small_mesh(const std::string& name) { return name == "grid" ? grid_mesh(6, 5, 0.2) : tripod_mesh(2); }

TEST(SuccessiveProjection, MatrixTypesAgree) {
  for (const char* mesh : {"grid", "tripod"}) {
    SheetOptions sheet_options;
    sheet_options.thickness = 0.1;
    for (const char* pins : {"exact", "paper"}) {
      Eigen::Matrix3Xd assembled;
      for (const std::string& type : mat_types()) {
        Scene scene(make_sheet(PETSC_COMM_WORLD, small_mesh(mesh), sheet_options));
        perturb(scene, 0.05);
        scene.scale_targets(Colour::blue, 0.97);
        for (std::size_t i = 0; i < scene.pinned.size(); ++i) {
          scene.pinned[i] = scene.sheet.persistent_id[i] < 4;
        }
        ProjectOptions options = tight_options();
        options.shift = 1e-3;
        options.max_steps = 4;
        options.pins = pins;
        options.mat_type = type;
        SuccessiveProjection projection(scene.sheet, options);
        const Eigen::Matrix3Xd before = by_id(scene.sheet, scene.x);
        const StageResult result = projection.advance(scene.x, scene.input());
        EXPECT_TRUE(result.converged) << result.reason;
        const Eigen::Matrix3Xd after = by_id(scene.sheet, scene.x);
        EXPECT_EQ((after - before).leftCols(4).norm(), 0) << "pinned particles moved";
        EXPECT_GT((after - before).norm(), 0.01);
        if (assembled.cols() == 0) {
          assembled = after;
        }
        EXPECT_LE((after - assembled).cwiseAbs().maxCoeff(), 1e-10) << mesh << " " << pins << " " << type;
      }
    }
  }
}

TEST(SuccessiveProjection, GhostsAreUpToDateAfterwards) {
  Scene scene(grid_sheet(8, 0.5));
  scene.scale_targets(Colour::blue, 0.98);
  SuccessiveProjection projection(scene.sheet, ProjectOptions{});
  EXPECT_TRUE(projection.advance(scene.x, scene.input()).converged);
  const Eigen::MatrixXd values = scene.x.values();
  scene.x.update_ghosts();
  EXPECT_EQ(values, scene.x.values());
}

TEST(SuccessiveProjection, ShiftSoftensTheCorrection) {
  // A single free spring: G = 2 (2 d/l)^2, the shift s makes it (1 + s) G, so the ends move 1/(1 + s) of the way; with
  // true masses (1 + 2 s) G.
  const Eigen::Matrix3Xd rest = (Eigen::Matrix3Xd(3, 2) << 0, 1, 0, 0, 0, 0).finished();
  for (const auto& [masses, shift] : {std::pair("equal", 0.0), std::pair("equal", 0.01), std::pair("equal", 0.5),
                                      std::pair("true", 0.0), std::pair("true", 0.25)}) {
    Scene scene(hand_made_sheet(rest, {{Colour::red, {{0, 1}}}}));
    scene.scale_targets(Colour::red, 0.9);
    ProjectOptions options = tight_options();
    options.masses = masses;
    options.shift = shift;
    SuccessiveProjection projection(scene.sheet, options);
    EXPECT_TRUE(projection.project(scene.x, Colour::red, scene.input()).converged);
    // Newton for |x_a - x_b| = 0.9 from 1: (1 + 0.81)/2.
    const double whole = 1 - 0.905;
    EXPECT_NEAR(scene.x.vector(1)[0] - scene.x.vector(0)[0],
                1 - whole / (1 + (options.masses == GramMasses::actual ? 2 : 1) * shift), 1e-14);
  }
}

TEST(SuccessiveProjection, WeightIsTheShareThatIsCorrected) {
  const Eigen::Matrix3Xd rest = (Eigen::Matrix3Xd(3, 4) << 0, 1, 5, 6, 0, 0, 0, 0, 0, 0, 0, 0).finished();
  Scene scene(hand_made_sheet(rest, {{Colour::red, {{0, 1}, {2, 3}}}, {Colour::blue, {{0, 2}, {1, 3}}}}));
  scene.scale_targets(Colour::red, 0.9);
  scene.scale_targets(Colour::blue, 0.9);
  ProjectOptions options = tight_options();
  options.weight = {0.5, 1, 0, 1};  // blue: inactive
  options.max_steps = 1;
  std::array<std::vector<double>, 4> factor;
  factor[0] = {1, 0.2};
  SuccessiveProjection projection(scene.sheet, options, factor);
  EXPECT_TRUE(projection.advance(scene.x, scene.input()).converged);
  const double whole = 1 - 0.905;
  EXPECT_NEAR(scene.x.vector(1)[0] - scene.x.vector(0)[0], 1 - 0.5 * whole, 1e-14);
  EXPECT_NEAR(scene.x.vector(3)[0] - scene.x.vector(2)[0], 1 - 0.1 * whole, 1e-14);
}

TEST(SuccessiveProjection, SpringWithoutLengthLeavesTheOthersAlone) {
  for (const std::string& type : mat_types()) {
    for (const double shift : {0.0, 1e-2}) {
      Scene scene(grid_sheet(6, 0.5));
      perturb(scene, 0.02);
      // Two corners of the first cell coincide.
      Eigen::Vector3d place = Eigen::Vector3d::Zero();
      for (PetscInt i = 0; i < scene.sheet.particles.local(); ++i) {
        if (scene.sheet.persistent_id[i] <= 1) {
          scene.x.vector(i) = place;
        }
      }
      ProjectOptions options = tight_options();
      options.mat_type = type;
      options.shift = shift;
      SuccessiveProjection projection(scene.sheet, options);
      const StageResult result = projection.project(scene.x, Colour::blue, scene.input());
      EXPECT_TRUE(result.converged) << type << " " << shift << ": " << result.reason;
      EXPECT_TRUE(scene.x.values().allFinite());
    }
  }
}

/// Straight line of springs, both ends constrained: its targets contradict the distance of the ends.
struct HeldLine : Scene {
  HeldLine() : Scene(hand_made_sheet(line(), springs())) {
    pinned.front() = pinned.back() = true;
    scale_targets(Colour::blue, 0.99);
  }
  static Eigen::Matrix3Xd line() {
    Eigen::Matrix3Xd rest = Eigen::Matrix3Xd::Zero(3, 11);
    rest.row(0).setLinSpaced(0, 1);
    return rest;
  }
  static std::map<Colour, std::vector<std::array<PetscInt, 2>>> springs() {
    std::map<Colour, std::vector<std::array<PetscInt, 2>>> result;
    for (PetscInt i = 0; i < 10; ++i) {
      result[Colour::blue].push_back({i, i + 1});
    }
    return result;
  }
};

TEST(SuccessiveProjection, SingularSystemIsCuredByTheShift) {
  for (const std::string& type : mat_types()) {
    HeldLine scene;
    ProjectOptions options = tight_options();
    options.shift = 1e-2;
    options.mat_type = type;
    SuccessiveProjection projection(scene.sheet, options);
    const StageResult result = projection.advance(scene.x, scene.input());
    EXPECT_TRUE(result.converged) << result.reason;
    // All springs pull alike, so nothing moves.
    EXPECT_LE((scene.x.values() - scene.sheet.rest).cwiseAbs().maxCoeff(), 1e-10);
  }
}

TEST(SuccessiveProjection, SingularSystemWithoutShiftNeverGivesNonsense) {
  for (const std::string& type : mat_types()) {
    HeldLine scene;
    ProjectOptions options = tight_options();
    options.mat_type = type;
    SuccessiveProjection projection(scene.sheet, options);
    const StageResult result = projection.advance(scene.x, scene.input());
    print_once("held line without shift, %s: %s\n", type.c_str(),
               result.converged ? "converged" : result.reason.c_str());
    EXPECT_TRUE(scene.x.values().allFinite()) << type;
    if (!result.converged) {
      EXPECT_NE(result.reason.find("project_blue_"), std::string::npos) << result.reason;
      EXPECT_EQ(scene.x.values(), scene.sheet.rest);
    }
  }
}

TEST(SuccessiveProjection, HeldEverywhereIsLeftAlone) {
  Scene scene(grid_sheet(4, 0.5));
  scene.pinned.assign(scene.pinned.size(), true);
  scene.scale_targets(Colour::blue, 0.9);
  SuccessiveProjection projection(scene.sheet, ProjectOptions{});
  EXPECT_TRUE(projection.advance(scene.x, scene.input()).converged);
  EXPECT_EQ(scene.x.values(), scene.sheet.rest);
}

// Results and failures.

TEST(SuccessiveProjection, SheetThatKeepsItsLengthsIsLeftAlone) {
  Scene scene(grid_sheet(6, 0.5));
  SuccessiveProjection projection(scene.sheet, ProjectOptions{});
  int corrections = 0;
  ProjectionInput input = scene.input();
  input.after_step = [&](Field&) { ++corrections; };
  const StageResult result = projection.advance(scene.x, input);
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.iterations, 0);
  EXPECT_LT(result.error, 1e-7);
  EXPECT_EQ(corrections, 1) << "a body may have run into the sheet";
  EXPECT_EQ(scene.x.values(), scene.sheet.rest);
}

TEST(SuccessiveProjection, ErrorsAreNormsOverAllRanks) {
  Scene scene(grid_sheet(6, 0.5));
  scene.scale_targets(Colour::blue, 0.9);
  scene.scale_targets(Colour::yellow, 1.2);
  const SuccessiveProjection projection(scene.sheet, ProjectOptions{});
  const ProjectionError error = projection.errors(scene.x, scene.input());
  // C = l^init (1/f - f); 84 edges of 1/6, 72 diagonals of sqrt(2)/6.
  const double blue = (1 / 0.9 - 0.9) / 6 * std::sqrt(84);
  const double yellow = (1.2 - 1 / 1.2) * std::sqrt(2) / 6 * std::sqrt(72);
  EXPECT_NEAR(error.colour[2], blue, 1e-13);
  EXPECT_NEAR(error.colour[3], yellow, 1e-13);
  EXPECT_LE(error.colour[0] + error.colour[1], 1e-13);
  EXPECT_NEAR(error.total, std::hypot(blue, yellow), 1e-13);
}

TEST(SuccessiveProjection, DivergenceIsAResultWithAReason) {
  Scene scene(grid_sheet(6, 0.5));
  scene.scale_targets(Colour::blue, 0.9);
  ProjectOptions options;
  options.error_limit = 1e-3;
  SuccessiveProjection projection(scene.sheet, options);
  const StageResult result = projection.advance(scene.x, scene.input());
  EXPECT_FALSE(result.converged);
  EXPECT_NE(result.reason.find("project.error_limit"), std::string::npos) << result.reason;
  EXPECT_GT(result.error, 0);
}

TEST(SuccessiveProjection, PositionsThatAreNotNumbersAreAFailure) {
  Scene scene(grid_sheet(4, 0.5));
  scene.x.values()(0, 0) = std::numeric_limits<double>::quiet_NaN();
  scene.x.update_ghosts();
  SuccessiveProjection projection(scene.sheet, ProjectOptions{});
  const StageResult result = projection.advance(scene.x, scene.input());
  EXPECT_FALSE(result.converged);
  EXPECT_FALSE(result.reason.empty());
}

TEST(SuccessiveProjection, OrderIsAPermutation) {
  EXPECT_EQ(names_of(ColourOrder{}).size(), 24U);
  EXPECT_EQ(ProjectOptions().order.name(), "RGBY");
  EXPECT_EQ(colours_of("GYRB"), (std::array{Colour::green, Colour::yellow, Colour::red, Colour::blue}));
  for (const std::string order : {"RGB", "RGBB", "RGBYR", "rgby", ""}) {
    ProjectOptions options;
    try {
      options.order = order;
      FAIL() << order;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("\"" + order + "\""), std::string::npos) << error.what();
    }
  }
  Scene scene(grid_sheet(4, 0.5));
  scene.scale_targets(Colour::blue, 0.99);
  ProjectOptions options;
  options.order = "YBGR";
  options.max_steps = 1;
  options.monitor = true;
  SuccessiveProjection projection(scene.sheet, options);
  const StageResult result = projection.advance(scene.x, scene.input());
  EXPECT_TRUE(result.converged);
  EXPECT_GT(result.iterations, 0);
  const auto& curve = projection.monitored();
  ASSERT_EQ(curve.size(), 5U);
  EXPECT_FALSE(curve[0].projected.has_value());
  EXPECT_EQ(curve[1].projected, Colour::yellow);
  EXPECT_EQ(curve[2].projected, Colour::blue);
  EXPECT_EQ(curve[3].projected, Colour::green);
  EXPECT_EQ(curve[4].projected, Colour::red);
}

}  // namespace
}  // namespace pellicle
