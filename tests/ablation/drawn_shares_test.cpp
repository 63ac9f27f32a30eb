#include "ablation/drawn_shares.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "ablation/ablation.h"
#include "ablation/cut_surface.h"
#include "parallel/collective.h"
#include "tests/ablation/sheets.h"

namespace pellicle {
namespace {

/// A grid of unit cells, crumpled, whose mass ratio is a function of the undeformed place; burnt where it is below 0.5.
struct BurntSheet {
  BurntSheet(int nx, int ny, const std::function<double(const Eigen::Vector3d&)>& ratio, double crumpling,
             SpringRule rule = SpringRule::surface, MPI_Comm comm = PETSC_COMM_WORLD)
      : sheet(shell_of(grid_mesh(nx, ny, 1.0), comm)),
        active(sheet),
        positions(sheet.particles, 3),
        mass(sheet.particles, 1) {
    positions.values() = sheet.rest + crumpling * (7 * sheet.rest).array().sin().matrix();
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      mass.data()[i] = ratio(sheet.rest.col(i)) * sheet.initial_mass[i];
    }
    const std::vector<double> level = level_set(sheet, mass, 0.5);
    burn_away(sheet, rule, active, level);
    for (const PetscInt i : bare_particles(sheet, active, mass)) {
      mass.data()[i] = 0;
    }
    mass.update_ghosts();
    surface = cut_surface(sheet, active, level);
  }

  double whole(const Field& amount) const {
    return sum_over_ranks(PETSC_COMM_WORLD, amount.values().row(0).head(sheet.particles.owned).sum());
  }
  /// Sum of density times area over the surface triangles of all ranks.
  double drawn(const std::vector<double>& density) const {
    double sum = 0;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      const auto corner = [&](std::size_t k) {
        const DrawnPoint& point = surface.points[surface.triangles[t][k]];
        Eigen::Vector3d x = Eigen::Vector3d::Zero();
        for (std::size_t j = 0; j < 4; ++j) {
          x += point.weights[j] * positions.vector(point.particles[j]);
        }
        return x;
      };
      const double area = 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
      sum += area * density[surface.elements[t]];
    }
    return sum_over_ranks(PETSC_COMM_WORLD, sum);
  }

  Sheet sheet;
  ActiveSet active;
  Field positions;
  Field mass;
  DrawnSurface surface;
};

TEST(DrawnShares, OfAnUnburntSheetAreItsDensity) {
  const BurntSheet flat(
      7, 5, [](const Eigen::Vector3d&) { return 1.0; }, 0);
  const std::vector<double> density =
      DrawnShares(flat.sheet, flat.active, flat.surface, flat.positions).density(flat.mass);
  for (std::size_t cell = 0; cell < density.size(); ++cell) {
    EXPECT_NEAR(density[cell], cell < static_cast<std::size_t>(flat.sheet.elements.owned) ? test_density : 0, 1e-15);
  }
}

// Holes, lace, strips, a front, and crumbs of which little is drawn.
TEST(DrawnShares, AddUpToWhatTheParticlesHave) {
  const std::vector<std::function<double(const Eigen::Vector3d&)>> ratios{
      [](const Eigen::Vector3d& x) { return 0.55 + 0.2 * std::sin(2 * x.x()) * std::cos(1.7 * x.y()); },
      [](const Eigen::Vector3d& x) { return 0.5 + 0.3 * std::sin(40 * x.x() + 30 * x.y()); },
      [](const Eigen::Vector3d& x) { return 0.45 + 0.1 * std::sin(3.1 * x.x() + 0.3); },
      [](const Eigen::Vector3d& x) { return 0.3 + 0.05 * x.x(); },
      [](const Eigen::Vector3d& x) {
        return 0.5 - 0.3 * std::pow(std::sin(2 * x.x()) * std::sin(2 * x.y()), 2) + 1e-3;
      }};
  for (std::size_t n = 0; n < ratios.size(); ++n) {
    for (const double crumpling : {0.0, 0.2}) {
      const BurntSheet sheet(11, 8, ratios[n], crumpling);
      const DrawnShares shares(sheet.sheet, sheet.active, sheet.surface, sheet.positions);
      Field heat(sheet.sheet.particles, 1);
      for (PetscInt i = 0; i < sheet.sheet.particles.local(); ++i) {
        heat.data()[i] = sheet.mass.data()[i] * (300 + 100 * std::sin(9 * sheet.sheet.rest(0, i)));
      }
      EXPECT_GT(sheet.whole(sheet.mass), 0.01) << n;
      EXPECT_LT(sheet.whole(sheet.mass), 0.9 * test_density * 88) << n;
      EXPECT_NEAR(sheet.drawn(shares.density(sheet.mass)), sheet.whole(sheet.mass), 1e-12 * sheet.whole(sheet.mass))
          << n;
      EXPECT_NEAR(sheet.drawn(shares.density(heat)), sheet.whole(heat), 1e-12 * sheet.whole(heat)) << n;
    }
  }
}

/// All has burnt but the centres of every other quad, whose springs hold those between them.
double only_every_other_centre(const Eigen::Vector3d& x) {
  const bool is_centre = x.x() - std::floor(x.x()) > 0.25;
  return is_centre && static_cast<int>(std::floor(x.x()) + std::floor(x.y())) % 2 == 0 ? 0.9 : 0.4;
}

// What springs hold without a triangle gives to cells of other ranks, too.
TEST(DrawnShares, OfHeldParticlesDoNotDependOnTheRanks) {
  const auto densities = [](MPI_Comm comm) {
    const BurntSheet sheet(11, 8, only_every_other_centre, 0.1, SpringRule::triangles, comm);
    const std::vector<double> density =
        DrawnShares(sheet.sheet, sheet.active, sheet.surface, sheet.positions).density(sheet.mass);
    std::vector<double> by_cell(11 * 8, 0);
    for (PetscInt cell = 0; cell < sheet.sheet.elements.owned; ++cell) {
      by_cell[sheet.sheet.persistent_id[sheet.sheet.lattice[cell]] - sheet.sheet.first_lattice_id] = density[cell];
    }
    sum_over_ranks(comm, by_cell);
    return by_cell;
  };
  const std::vector<double> whole = densities(PETSC_COMM_SELF);
  const std::vector<double> divided = densities(PETSC_COMM_WORLD);
  for (std::size_t cell = 0; cell < whole.size(); ++cell) {
    EXPECT_NEAR(divided[cell], whole[cell], 1e-12) << cell;
  }
}

// A front just behind a row of corners: slivers are drawn of the cells beyond it, which hold much mass.
TEST(DrawnShares, SliversAtAFrontAreNotHeavy) {
  const BurntSheet front(
      9, 4, [](const Eigen::Vector3d& x) { return std::clamp(0.5 + 0.1 * (4.01 - x.x()), 0.3, 1.0); }, 0);
  const std::vector<double> density =
      DrawnShares(front.sheet, front.active, front.surface, front.positions).density(front.mass);
  const double largest =
      max_over_ranks(PETSC_COMM_WORLD, density.empty() ? 0 : *std::max_element(density.begin(), density.end()));
  EXPECT_LT(largest, 2 * test_density);
  EXPECT_NEAR(front.drawn(density), front.whole(front.mass), 1e-12);
}

}  // namespace
}  // namespace pellicle
