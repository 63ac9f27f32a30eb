// Dead springs and removed particles: what lives moves as if they were not there. Also the pull of each spring.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "tests/projection/sheets.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

constexpr int columns = 8;
constexpr int rows = 8;  ///< of the whole sheet; the lower half of them lives
constexpr double edge = 0.125;
constexpr double middle = 0.5 * rows * edge;

/// A number of each particle that the whole sheet and its lower half have in common.
PetscInt key_of(const Sheet& sheet, PetscInt particle) {
  const PetscInt id = sheet.persistent_id[particle];
  return id < sheet.first_lattice_id ? id : 1000 + id - sheet.first_lattice_id;
}

using ByKey = std::map<PetscInt, Eigen::Vector3d>;
using ByEnds = std::map<std::pair<PetscInt, PetscInt>, double>;

ByKey by_key(const Sheet& sheet, const Field& x) {
  ByKey result;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    result[key_of(sheet, i)] = x.vector(i);
  }
  return result;
}

/// Values of owned springs by the keys of their ends.
ByEnds by_ends(const Sheet& sheet, const std::array<std::vector<double>, 4>& values) {
  ByEnds result;
  for (std::size_t colour = 0; colour < 4; ++colour) {
    for (std::size_t s = 0; s < values[colour].size(); ++s) {
      const auto [a, b] = sheet.springs[colour].ends[s];
      result[std::minmax(key_of(sheet, a), key_of(sheet, b))] = values[colour][s];
    }
  }
  return result;
}

/// Crumpled, shrunk, of uneven masses, constrained at two corners; all as functions of the keys. What lies above
/// `height` is dead and has left.
struct HalfScene : Scene {
  HalfScene(MPI_Comm comm, int its_rows, double height) : Scene(make(comm, its_rows)) {
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      const auto index = static_cast<std::size_t>(i);
      const auto key = static_cast<double>(key_of(sheet, i));
      x.vector(i) += 0.05 * edge * Eigen::Vector3d(std::sin(7 * key), std::sin(11 * key + 1), std::sin(13 * key + 2));
      mass[index] = is_above(i, height) ? 0 : 1 + 0.5 * std::sin(5 * key);
      pinned[index] = key == 0 || key == columns;
    }
    scale_targets(Colour::blue, 0.97);
    for (std::size_t colour = 0; colour < 4; ++colour) {
      for (std::size_t s = 0; s < sheet.springs[colour].ends.size(); ++s) {
        const auto [a, b] = sheet.springs[colour].ends[s];
        active.springs[colour][s] = !is_above(a, height) && !is_above(b, height);
      }
    }
  }
  static Sheet make(MPI_Comm comm, int its_rows) {
    SheetOptions options;
    options.thickness = 0.5 * edge;
    return make_sheet(comm, grid_mesh(columns, its_rows, edge), options);
  }
  bool is_above(PetscInt particle, double height) const { return sheet.rest(1, particle) > height + 1e-9; }
  ProjectionInput input() {
    ProjectionInput result = Scene::input();
    result.pull = &pull;
    return result;
  }

  std::array<std::vector<double>, 4> pull;
};

/// What lives is where the part alone is, what has left where it was.
void expect_same(const HalfScene& scene, const Eigen::MatrixXd& start, const ByKey& part, double tolerance,
                 const std::string& what) {
  for (PetscInt i = 0; i < scene.sheet.particles.local(); ++i) {
    const PetscInt key = key_of(scene.sheet, i);
    const bool has_left = scene.is_above(i, middle);
    const Eigen::Vector3d expected = has_left ? Eigen::Vector3d(start.col(i)) : part.at(key);
    EXPECT_LE((scene.x.vector(i) - expected).cwiseAbs().maxCoeff(), has_left ? 0 : tolerance) << what << ", " << key;
  }
}

TEST(DeadSprings, SheetMovesAsThePartThatLives) {
  for (const char* masses : {"equal", "true"}) {
    for (const char* pins : {"exact", "paper"}) {
      for (const double shift : {0.0, 1e-2}) {
        ProjectOptions options = tight_options();
        options.masses = masses;
        options.pins = pins;
        options.shift = shift;
        options.max_steps = 4;
        // The part alone, all of it on each rank.
        HalfScene part(PETSC_COMM_SELF, rows / 2, middle);
        options.mat_type = "aij";
        SuccessiveProjection part_projection(part.sheet, options);
        const StageResult expected = part_projection.advance(part.x, part.input());
        ASSERT_TRUE(expected.converged) << expected.reason;
        const ByKey places = by_key(part.sheet, part.x);
        const ByEnds pulls = by_ends(part.sheet, part.pull);
        for (const std::string type : {"aij", "sell", "shell", "lines"}) {
          const std::string what = type + ", " + masses + " masses, " + pins + " pins, shift " + std::to_string(shift);
          HalfScene scene(PETSC_COMM_WORLD, rows, middle);
          const Eigen::MatrixXd start = scene.x.values();
          options.mat_type = type;
          SuccessiveProjection projection(scene.sheet, options);
          const StageResult result = projection.advance(scene.x, scene.input());
          EXPECT_TRUE(result.converged) << what << ": " << result.reason;
          EXPECT_NEAR(result.error, expected.error, 1e-10) << what;
          expect_same(scene, start, places, 1e-10, what);
          for (const auto& [ends, pull] : by_ends(scene.sheet, scene.pull)) {
            const auto other = pulls.find(ends);
            if (other == pulls.end()) {
              EXPECT_EQ(pull, 0) << what;
            } else {
              EXPECT_NEAR(pull, other->second, 1e-9) << what;
            }
          }
        }
      }
    }
  }
}

TEST(DeadSprings, CountInNoNorm) {
  HalfScene whole(PETSC_COMM_WORLD, rows, middle);
  HalfScene part(PETSC_COMM_WORLD, rows / 2, middle);
  ProjectOptions options = tight_options();
  options.error_limit = 1e-6;
  SuccessiveProjection whole_projection(whole.sheet, options);
  SuccessiveProjection part_projection(part.sheet, options);
  const ProjectionError found = whole_projection.errors(whole.x, whole.input());
  const ProjectionError expected = part_projection.errors(part.x, part.input());
  for (std::size_t colour = 0; colour < 4; ++colour) {
    EXPECT_NEAR(found.colour[colour], expected.colour[colour], 1e-13);
  }
  // The reason of a failure holds ||C|| / ||l||.
  const StageResult whole_result = whole_projection.advance(whole.x, whole.input());
  const StageResult part_result = part_projection.advance(part.x, part.input());
  EXPECT_FALSE(whole_result.converged);
  EXPECT_EQ(whole_result.reason, part_result.reason);
}

TEST(DeadSprings, NothingThatLivesIsNoFailure) {
  for (const std::string type : {"aij", "sell", "shell", "lines"}) {
    HalfScene scene(PETSC_COMM_WORLD, rows, -1);
    const Eigen::MatrixXd start = scene.x.values();
    ProjectOptions options = tight_options();
    options.mat_type = type;
    options.masses = "true";
    SuccessiveProjection projection(scene.sheet, options);
    const StageResult result = projection.advance(scene.x, scene.input());
    EXPECT_TRUE(result.converged) << result.reason;
    EXPECT_EQ(result.error, 0);
    EXPECT_EQ(scene.x.values(), start);
  }
}

// Pull.

struct OneSpring : Scene {
  OneSpring(double length, bool is_held)
      : Scene(hand_made_sheet((Eigen::Matrix3Xd(3, 2) << 0, 1, 0, 0, 0, 0).finished(), {{Colour::blue, {{0, 1}}}})) {
    x.vector(1).x() = length;
    pinned[0] = is_held;
    mass = {1, 3};
  }
  double length() const { return (x.vector(1) - x.vector(0)).norm(); }
  double pulled(const ProjectOptions& options) {
    std::array<std::vector<double>, 4> pull;
    ProjectionInput its_input = input();
    its_input.pull = &pull;
    SuccessiveProjection projection(sheet, options);
    EXPECT_TRUE(projection.advance(x, its_input).converged);
    EXPECT_EQ(pull[0].size() + pull[1].size() + pull[3].size(), 0U);
    return pull[2].at(0);
  }
};

TEST(Pull, IsWhatASpringBecameShorter) {
  for (const double length : {1.1, 0.95}) {
    for (const bool is_held : {false, true}) {
      for (const char* masses : {"equal", "true"}) {
        ProjectOptions options = tight_options();
        options.masses = masses;
        options.shift = 0.25;
        options.max_steps = 1;
        OneSpring one(length, is_held);
        // Newton's step for |x_a - x_b| = 1 from d goes to (d + 1/d)/2; the shift leaves 1/(1 + shift) of it, relative
        // to the spring's own inverse masses, or to those of two particles of half the mean mass of 2 kg.
        const double inverse_masses = is_held ? 1.0 / 3 : 1 + 1.0 / 3;
        const double fraction = 1 / (1 + 0.25 * (std::string(masses) == "true" ? 2 / inverse_masses : 1));
        EXPECT_NEAR(one.pulled(options), (length - 1 / length) / 2 * fraction, 1e-14);
        EXPECT_NEAR(one.length(), length - (length - 1 / length) / 2 * fraction, 1e-14);
        options.max_steps = 9;
        OneSpring several(length, is_held);
        const double pulled = several.pulled(options);
        EXPECT_NEAR(pulled, length - several.length(), 1e-14);
      }
    }
  }
}

/// Steps of free fall and projection until the sheet hangs still, with the pull of the last.
template <class AnyScene>
std::array<std::vector<double>, 4> hang(AnyScene& scene, const ProjectOptions& options, double h, double g) {
  std::array<std::vector<double>, 4> pull;
  ProjectionInput input = scene.input();
  input.pull = &pull;
  SuccessiveProjection projection(scene.sheet, options);
  Eigen::MatrixXd velocity = Eigen::MatrixXd::Zero(3, scene.x.values().cols());
  for (int step = 0; step < 150; ++step) {
    const Eigen::MatrixXd start = scene.x.values();
    velocity.row(1).array() -= h * g;
    for (PetscInt i = 0; i < scene.sheet.particles.local(); ++i) {
      if (!scene.pinned[i]) {
        scene.x.vector(i) += h * velocity.col(i);
      }
    }
    const StageResult result = projection.advance(scene.x, input);
    EXPECT_TRUE(result.converged) << result.reason;
    velocity = 0.5 * (scene.x.values() - start) / h;
  }
  return pull;
}

TEST(Pull, OfAHangingChainIsTheWeightBelow) {
  const PetscInt count = 7;
  Eigen::Matrix3Xd rest = Eigen::Matrix3Xd::Zero(3, count);
  std::map<Colour, std::vector<std::array<PetscInt, 2>>> springs;
  for (PetscInt i = 0; i < count; ++i) {
    rest(1, i) = -0.1 * static_cast<double>(i);
    if (i > 0) {
      springs[i % 3 == 0 ? Colour::green : Colour::blue].push_back({i - 1, i});
    }
  }
  Scene scene(hand_made_sheet(rest, springs));
  scene.pinned[0] = true;
  scene.mass.assign(scene.mass.size(), 0.3);
  const double h = 1e-3;
  const double g = 9.81;
  ProjectOptions options;  // as users have them
  options.threshold = 0;
  const std::array<std::vector<double>, 4> pull = hang(scene, options, h, g);
  for (const Colour colour : {Colour::blue, Colour::green}) {
    const SpringSet& set = scene.sheet.of(colour);
    for (std::size_t s = 0; s < set.ends.size(); ++s) {
      const PetscInt below = set.ends[s][1];
      // One end moves below the pin, two elsewhere.
      const double inverse_masses = (below == 1 ? 1 : 2) / 0.3;
      const double tension = pull[static_cast<std::size_t>(colour)][s] / (h * h * inverse_masses);
      EXPECT_NEAR(tension / (static_cast<double>(count - below) * 0.3 * g), 1, 1e-3) << "below particle " << below - 1;
    }
  }
}

/// Force by which the springs hold what is below a height [N], on one rank.
double force_across(const Scene& scene, const std::array<std::vector<double>, 4>& pull, double height, double h) {
  double sum = 0;
  for (std::size_t colour = 0; colour < 4; ++colour) {
    for (std::size_t s = 0; s < pull[colour].size(); ++s) {
      const auto [a, b] = scene.sheet.springs[colour].ends[s];
      if ((scene.sheet.rest(1, a) < height) != (scene.sheet.rest(1, b) < height)) {
        const auto inverse_mass = [&scene](PetscInt particle) {
          const auto index = static_cast<std::size_t>(particle);
          return scene.pinned[index] ? 0 : 1 / scene.mass[index];
        };
        const Eigen::Vector3d along = (scene.x.vector(a) - scene.x.vector(b)).normalized();
        sum += pull[colour][s] / (h * h * (inverse_mass(a) + inverse_mass(b))) * std::abs(along.y());
      }
    }
  }
  return sum;
}

TEST(Pull, OfAHangingStripIsTheWeightBelow) {
  const double g = 9.81;
  const double h = 1e-3;
  for (const char* masses : {"equal", "true"}) {
    SheetOptions sheet_options;
    sheet_options.thickness = 0.05;
    // On each rank alone: the pulls of a sheet do not depend on ranks, see DeadSprings.
    Scene scene(make_sheet(PETSC_COMM_SELF, grid_mesh(3, 8, 0.1), sheet_options));
    if (std::string(masses) == "equal") {
      scene.mass.assign(scene.mass.size(), 0.01);
    }
    for (std::size_t i = 0; i < scene.pinned.size(); ++i) {
      scene.pinned[i] = scene.sheet.rest(1, static_cast<Eigen::Index>(i)) > 0.8 - 1e-9;
    }
    ProjectOptions options;  // as users have them
    options.threshold = 0;
    options.masses = masses;
    const std::array<std::vector<double>, 4> pull = hang(scene, options, h, g);
    for (int row = 0; row < 8; ++row) {
      for (const double fraction : {0.25, 0.75}) {
        const double height = (row + fraction) * 0.1;
        double weight = 0;
        for (PetscInt i = 0; i < scene.sheet.particles.owned; ++i) {
          weight += scene.sheet.rest(1, i) < height ? g * scene.mass[i] : 0;
        }
        const double force = force_across(scene, pull, height, h);
        EXPECT_NEAR(force / weight, 1, 0.03) << masses << " masses, height " << height;
        if (fraction == 0.25) {
          print_once("hanging strip, %s masses, height %g: force/weight %.4f\n", masses, height, force / weight);
        }
      }
    }
  }
}

}  // namespace
}  // namespace pellicle
