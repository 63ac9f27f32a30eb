// A sheet that is pulled apart: projection, tension, tearing and pieces together.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "ablation/ablation.h"
#include "ablation/tearing.h"
#include "projection/successive_projection.h"
#include "surface/pieces.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/print_once.h"

namespace pellicle::tearing_sheet_test {
namespace {

constexpr double edge = 0.05;  // [m]
constexpr int width = 4;       ///< cells across
constexpr int length = 10;     ///< cells along y
constexpr double h = 1e-3;     // [s]
constexpr double g = 9.81;     // [m/s^2]

double sum_of_all(double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  return value;
}

/// A strip that is held at its first row of corners, and at its last one if that moves.
class Strip {
 public:
  static constexpr double all_mass = width * edge * length * edge;  ///< of 1 kg/m^2

  /// @param weakest factor on the strength in the middle of the strip, which has 1 at its ends
  Strip(double strength, double scatter, double weakest, bool is_pulled, const std::string& masses)
      : sheet_(make()),
        living_(sheet_),
        pieces_(initial_pieces(sheet_)),
        x_(sheet_.particles, 3),
        velocity_(Eigen::Matrix3Xd::Zero(3, sheet_.particles.local())),
        mass_(sheet_.particles, 1),
        projection_(sheet_, project_options(masses)),
        ablation_(sheet_),
        tearing_(sheet_, ablation_options(strength, scatter), weak_middle(weakest)) {
    x_.values() = sheet_.rest;
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      const auto index = static_cast<std::size_t>(i);
      mass_.data()[i] = sheet_.initial_mass[index];
      is_last_.push_back(is_pulled && !sheet_.is_lattice[index] && sheet_.rest(1, i) > length * edge - 1e-9);
      pinned_.push_back(is_last_[index] || (!sheet_.is_lattice[index] && sheet_.rest(1, i) < 1e-9));
    }
    for (std::size_t colour = 0; colour < 4; ++colour) {
      target_[colour] = sheet_.springs[colour].initial_length;
    }
  }

  /// One step under gravity along the strip, the last row pulled at a speed.
  void advance(double gravity, double speed) {
    const Eigen::Matrix3Xd start = x_.values();
    velocity_.row(1).array() += h * gravity;
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      const auto index = static_cast<std::size_t>(i);
      if (!pinned_[index]) {
        x_.vector(i) += h * velocity_.col(i);
      } else if (is_last_[index]) {
        x_.vector(i).y() += h * speed;
      }
    }
    const std::vector<double> mass(mass_.data(), mass_.data() + sheet_.particles.local());
    const ProjectionInput input{target_, mass, pinned_, living_, {}, &force_};
    const StageResult result = projection_.advance(x_, input);
    to_forces(force_, sheet_, input, h);
    ASSERT_TRUE(result.converged) << result.reason;
    velocity_ = 0.95 * (x_.values() - start) / h;
    if (ablation_.tear(living_, tearing_.torn({living_, force_, x_, mass_, pinned_, 0.3}))) {
      update_pieces(pieces_, sheet_, living_, 1);
      for (const PetscInt i : ablation_.bare_particles(living_, mass_)) {
        lost_ += mass_.data()[i];
        mass_.data()[i] = 0;
      }
      mass_.update_ghosts();
    }
  }

  /// Largest tension per width of the last step [N/m]. Collective.
  double largest_tension() const {
    double largest = 0;
    for (std::size_t colour = 0; colour < 4; ++colour) {
      for (std::size_t s = 0; s < force_[colour].size(); ++s) {
        if (living_.springs[colour][s]) {
          largest = std::max(largest, force_[colour][s] / sheet_.springs[colour].initial_length[s]);
        }
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
    return largest;
  }

  /// Drawn triangles that are dead, of all ranks. Collective.
  double dead_triangles() const {
    return sum_of_all(static_cast<double>(
        std::count(living_.triangles.begin(), living_.triangles.begin() + 4 * sheet_.elements.owned, false)));
  }

  double lost() const { return sum_of_all(lost_); }
  const Pieces& pieces() const { return pieces_; }
  std::vector<double> masses_of_pieces() const { return piece_masses(pieces_, sheet_, mass_); }
  /// Largest and smallest y at which particles of a piece lay at rest. Collective.
  std::array<double, 2> extent(PetscInt piece) const {
    std::array<double, 2> ends{-std::numeric_limits<double>::max(), -std::numeric_limits<double>::max()};
    for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
      if (pieces_.of_particle[static_cast<std::size_t>(i)] == piece) {
        ends = {std::max(ends[0], -sheet_.rest(1, i)), std::max(ends[1], sheet_.rest(1, i))};
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, ends.data(), 2, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
    return {-ends[0], ends[1]};
  }

 private:
  static Sheet make() {
    SheetOptions options;
    options.thickness = 0.2 * edge;
    options.areal_density = 1;
    return make_sheet(PETSC_COMM_WORLD, grid_mesh(width, length, edge), options);
  }
  static ProjectOptions project_options(const std::string& masses) {
    ProjectOptions options;
    options.threshold = 0;
    options.masses = masses;
    return options;
  }
  static AblationOptions ablation_options(double strength, double scatter) {
    AblationOptions options;
    options.strength = strength;
    options.strength_scatter = scatter;
    return options;
  }
  std::vector<double> weak_middle(double weakest) const {
    std::vector<double> texture;
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      const double from_middle = std::abs(2 * sheet_.rest(1, i) / (length * edge) - 1);
      texture.push_back(weakest + (1 - weakest) * from_middle);
    }
    return texture;
  }

  Sheet sheet_;
  Living living_;
  Pieces pieces_;
  Field x_;
  Eigen::Matrix3Xd velocity_;
  Field mass_;
  SuccessiveProjection projection_;
  Ablation ablation_;
  Tearing tearing_;
  std::vector<bool> is_last_;
  std::vector<bool> pinned_;
  std::array<std::vector<double>, 4> target_;
  std::array<std::vector<double>, 4> force_;
  double lost_ = 0;
};

constexpr double unbreakable = 1e12;

/// Hundreds of steps of many small messages: minutes where several ranks share a core, and two show all that more
/// would.
class TearingSheet : public ::testing::Test {
 protected:
  void SetUp() override {
    int ranks = 1;
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    if (ranks > 2) {
      GTEST_SKIP() << "on one and two ranks only";
    }
  }
};

/// Two pieces, which share what mass is left and meet near the middle.
void expect_torn_in_the_middle(const Strip& strip) {
  const Pieces& pieces = strip.pieces();
  ASSERT_EQ(pieces.present.size(), 2U);
  const std::vector<double> masses = strip.masses_of_pieces();
  EXPECT_NEAR(masses[0] + masses[1] + strip.lost(), Strip::all_mass, 1e-15);
  std::array<std::array<double, 2>, 2> extents{strip.extent(pieces.present[0]), strip.extent(pieces.present[1])};
  if (extents[0][0] > extents[1][0]) {
    std::swap(extents[0], extents[1]);
  }
  print_once("torn: y %g to %g and %g to %g, masses %g and %g, lost %g\n", extents[0][0], extents[0][1], extents[1][0],
             extents[1][1], masses[0], masses[1], strip.lost());
  EXPECT_EQ(extents[0][0], 0);
  EXPECT_NEAR(extents[0][1], length * edge / 2, 1.5 * edge);
  EXPECT_NEAR(extents[1][0], length * edge / 2, 1.5 * edge);
  EXPECT_EQ(extents[1][1], length * edge);
  EXPECT_LT(extents[0][1], extents[1][0] + edge / 4) << "the pieces do not overlap";
}

TEST_F(TearingSheet, hangs_at_half_of_its_strength_and_tears_where_it_is_weak) {
  const double load = Strip::all_mass * g / (width * edge);  // at the pins [N/m]
  Strip strong(unbreakable, 0, 1, false, "true");
  Strip safe(2 * load, 0, 1, false, "true");
  for (int step = 0; step < 30; ++step) {
    strong.advance(g, 0);
    safe.advance(g, 0);
  }
  print_once("hanging strip: largest tension %g of the load\n", strong.largest_tension() / load);
  // No spring carries all of the load: the corner layer and the lattice layer lie side by side.
  EXPECT_GT(strong.largest_tension(), 0.5 * load);
  EXPECT_LT(strong.largest_tension(), load);
  EXPECT_EQ(strong.dead_triangles(), 0);
  EXPECT_EQ(safe.dead_triangles(), 0);
  Strip torn(load, 0, 0.2, false, "true");
  for (int step = 0; step < 150; ++step) {
    torn.advance(g, 0);
  }
  expect_torn_in_the_middle(torn);
}

/// Hangs a strip of uniform strength in a gravity that grows for 100 steps, or until it has torn. Collective.
/// @param strength a share of the strip's weight per width
/// @returns the share of the full gravity at which it first tears, and the lowest y of what falls
std::pair<double, double> first_tear(double strength) {
  Strip strip(strength * Strip::all_mass * g / (width * edge), 0, 1, false, "true");
  double share = 0;
  for (int step = 1; step <= 100 && (share == 0 || step < 100 * share + 10); ++step) {
    strip.advance(g * step / 100, 0);
    if (share == 0 && strip.dead_triangles() > 0) {
      share = step / 100.0;
    }
  }
  EXPECT_EQ(strip.pieces().present.size(), 1U) << "nothing but pinned points stays";
  return {share, strip.extent(strip.pieces().present.front())[0]};
}

TEST_F(TearingSheet, hangs_until_its_weight_exceeds_its_strength) {
  for (const double strength : {0.8, 0.4}) {
    const auto [share, lowest] = first_tear(strength);
    print_once("strength %g of the weight: tears at %g of it, from y = %g on\n", strength, share, lowest);
    EXPECT_NEAR(share, strength, 0.1 * strength);
    EXPECT_GT(lowest, 0);
    EXPECT_LT(lowest, 1.6 * edge) << "where the load is largest";
  }
  const auto [share, lowest] = first_tear(1.2);
  EXPECT_EQ(share, 0) << "holds";
  EXPECT_EQ(lowest, 0);
}

TEST_F(TearingSheet, pulled_by_its_pins_tears_where_it_is_weak) {
  const double speed = 0.2;
  Strip strong(unbreakable, 0, 1, true, "equal");
  double largest = 0;
  for (int step = 0; step < 30; ++step) {
    strong.advance(0, speed);
    EXPECT_GT(strong.largest_tension(), largest) << "it does not give way, step " << step;
    largest = strong.largest_tension();
  }
  Strip safe(2 * largest, 0, 1, true, "equal");
  for (int step = 0; step < 30; ++step) {
    safe.advance(0, speed);
  }
  EXPECT_EQ(safe.dead_triangles(), 0);
  Strip torn(largest / 4, 0.05, 0.3, true, "equal");
  for (int step = 0; step < 300; ++step) {
    torn.advance(0, speed);
  }
  expect_torn_in_the_middle(torn);
  EXPECT_LT(torn.largest_tension(), largest / 40) << "nothing pulls at the pieces any more";
}

}  // namespace
}  // namespace pellicle::tearing_sheet_test
