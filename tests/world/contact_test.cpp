#include <gtest/gtest.h>
#include <petscsys.h>

#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include "contact/crossings.h"
#include "contact/surface_contact.h"
#include "elastic/spring_sheet.h"
#include "surface/shell.h"
#include "tests/support/balanced_step.h"
#include "tests/support/balls.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/initial_lengths.h"
#include "tests/world/static_balloon.h"

namespace pellicle {
namespace {

constexpr double g = 9.81;
constexpr double edge = 0.05;  // of the sheets' cells [m]

/// Two square sheets of one mesh: a large one, and above it a small one, turned a little.
SurfaceMesh two_sheets(double gap) {
  SurfaceMesh small = grid_mesh(4, 4, edge);
  const Eigen::AngleAxisd turn(0.3, Eigen::Vector3d::UnitZ());
  for (Eigen::Vector3d& point : small.points) {
    point = turn * point;
  }
  return joined(grid_mesh(10, 10, edge), small, {0.17, 0.11, gap});
}

/// Elastic sheets that touch, in motion without heat.
class Touching {
 public:
  Touching(MPI_Comm comm, const SurfaceMesh& mesh, const ContactOptions& contact,
           const std::function<bool(const Eigen::Vector3d&)>& is_pinned = {},
           std::optional<double> bending_stiffness = {})
      : sheet(make_sheet(comm, mesh, sheet_options())),
        positions(sheet.particles, 3),
        velocities(sheet.particles, 3),
        start_(sheet.particles, 3) {
    positions.values() = sheet.rest;
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      pinned_.push_back(is_pinned && is_pinned(sheet.rest.col(i)));
    }
    ones_.assign(pinned_.size(), 1);
    ElasticOptions options;
    options.snes_rtol = 1e-8;
    options.max_iterations = 200;
    SheetMaterial material;
    material.tensile_stiffness = {500};
    material.bending_stiffness = bending_stiffness;
    material.damping = 0;
    this->contact = std::make_unique<SurfaceContact>(
        std::vector<ContactSurface::Part>{{&sheet, contact.thickness, *contact.stiffness}}, contact, !is_pinned);
    step_ =
        std::make_unique<BalancedStep<ElasticSheet>>(options, sheet, material, 0.01, MaterialFactors(), pinned_,
                                                     pinned_, options, std::vector<Potential*>{this->contact.get()});
  }

  void advance(double h, const Eigen::Vector3d& gravity = {0, 0, 0}) {
    start_.values() = positions.values();
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      if (!pinned_[i]) {
        velocities.vector(i) += h * gravity;
        positions.vector(i) += h * velocities.vector(i);
      }
    }
    const ImplicitResult result = step_->advance(
        positions, {{sheet.initial_mass, start_, h}, initial_lengths(sheet), ones_, ones_, ActiveSet(sheet)});
    ASSERT_TRUE(result.converged) << result.reason;
    velocities.values() = (positions.values() - start_.values()) / h;
  }

  /// Of the particles above the large sheet at rest: mass, momentum [kg m/s] and kinetic energy [J]; of all if not.
  Eigen::VectorXd motion(bool of_small) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(5);
    for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
      const double mass = sheet.initial_mass[i];
      const Eigen::Vector3d v = velocities.vector(i);
      if (!of_small || sheet.rest(2, i) > 0) {
        sum[0] += mass;
        sum.segment<3>(1) += mass * v;
        sum[4] += 0.5 * mass * v.squaredNorm();
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, sum.data(), 5, MPI_DOUBLE, MPI_SUM, sheet.comm());
    return sum;
  }

  double energy() const {
    return motion(false)[4] + step_->part.elastic_energy(positions) + contact->figures(positions).energy;
  }
  int crossings() const { return find_crossings({{sheet, positions, nullptr}}).pairs; }

  Sheet sheet;
  Field positions;
  Field velocities;
  std::unique_ptr<SurfaceContact> contact;

 private:
  static SheetOptions sheet_options() {
    SheetOptions options;
    options.is_one_surface = true;
    options.areal_density = 0.2;
    return options;
  }

  std::vector<bool> pinned_;
  std::vector<double> ones_;
  std::unique_ptr<BalancedStep<ElasticSheet>> step_;
  Field start_;
};

ContactOptions touching(double friction = 0) {
  ContactOptions options;
  options.self = true;
  options.thickness = 5e-3;
  options.stiffness = 4e6;
  options.friction = friction;
  return options;
}

SurfaceMesh on_first(MPI_Comm comm, const SurfaceMesh& mesh) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank == 0 ? mesh : SurfaceMesh();
}

TEST(Contact, BouncingSheetsKeepTheirMomentumAndGainNoEnergy) {
  Touching sheets(PETSC_COMM_WORLD, on_first(PETSC_COMM_WORLD, two_sheets(0.02)), touching());
  for (PetscInt i = 0; i < sheets.sheet.particles.local(); ++i) {
    sheets.velocities.vector(i) = Eigen::Vector3d(0, 0, sheets.sheet.rest(2, i) > 0 ? -2 : 0.5);
  }
  const Eigen::VectorXd before = sheets.motion(false);
  double energy = sheets.energy();
  bool have_touched = false;
  for (int n = 0; n < 30; ++n) {
    sheets.advance(1e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    have_touched = have_touched || sheets.contact->figures(sheets.positions).contacts > 0;
    EXPECT_LE(sheets.energy(), energy * (1 + 1e-9)) << "step " << n;
    energy = sheets.energy();
    EXPECT_EQ(sheets.crossings(), 0) << "step " << n;
  }
  EXPECT_TRUE(have_touched);
  EXPECT_LT((sheets.motion(false) - before).segment<3>(1).norm(), 1e-6 * before.segment<3>(1).norm());
  // The small one has been stopped and turned back.
  const Eigen::VectorXd small = sheets.motion(true);
  EXPECT_GT(small[3] / small[0], -0.3);
}

/// Upper sheets of a mesh slide, or not, down a slope along an axis on the pinned lower one, at z = 0.
void expect_coulomb(const SurfaceMesh& mesh, Eigen::Index axis) {
  constexpr double friction = 0.5;
  constexpr double h = 2e-3;
  for (const double tangent : {0.4, 0.8}) {
    constexpr double stiff = 1;  // [N m]: what stands on its edges does not sway for long
    Touching sheets(
        PETSC_COMM_WORLD, on_first(PETSC_COMM_WORLD, mesh), touching(friction),
        [](const Eigen::Vector3d& place) { return place.z() < 1e-3; }, stiff);
    for (PetscInt i = 0; i < sheets.sheet.particles.local(); ++i) {
      if (sheets.sheet.rest(2, i) > 1e-3) {
        sheets.positions.vector(i).z() -= 5e-3;  // The upper one begins where it touches.
      }
    }
    const double slope = std::atan(tangent);
    const Eigen::Vector3d gravity =
        g * (std::sin(slope) * Eigen::Vector3d::Unit(axis) - std::cos(slope) * Eigen::Vector3d::UnitZ());
    const auto speed = [&] {
      const Eigen::VectorXd small = sheets.motion(true);
      return small[1 + axis] / small[0];
    };
    constexpr int steps = 30;
    for (int n = 0; n < steps; ++n) {
      sheets.advance(h, gravity);
      ASSERT_FALSE(::testing::Test::HasFatalFailure());
    }
    const double first = speed();
    for (int n = 0; n < steps; ++n) {
      sheets.advance(h, gravity);
      ASSERT_FALSE(::testing::Test::HasFatalFailure());
    }
    const double expected = std::max(g * std::cos(slope) * (tangent - friction), 0.0);
    EXPECT_NEAR((speed() - first) / (steps * h), expected, 0.03 * g) << tangent;
    if (tangent < friction) {
      EXPECT_LT(std::abs(speed()), touching().slip_speed);
    }
    EXPECT_EQ(sheets.crossings(), 0);
  }
}

TEST(Contact, SheetOnASlopeSticksOrSlipsAsCoulombSays) { expect_coulomb(two_sheets(0.01), 0); }

// It stands on its two edges alone.
TEST(Contact, RolledEdgesOnASlopeStickOrSlipAsCoulombSays) {
  SurfaceMesh arch = grid_mesh(4, 4, edge);
  for (Eigen::Vector3d& point : arch.points) {
    const double angle = (point.x() - 2 * edge) / 0.1;
    point = {0.1 * std::sin(angle) + 0.1, point.y(), 0.1 * (std::cos(angle) - std::cos(1.0))};
  }
  expect_coulomb(joined(grid_mesh(10, 10, edge), arch, {0.137, 0.11, 0.01}), 1);
}

// Two sheets side by side, whose neighbouring edges have their vertices in the same places, as the crack faces of a
// crack have.
TEST(Contact, LipsOfACrackOpenAndCloseAndDoNotPassThroughEachOther) {
  const SurfaceMesh half = grid_mesh(4, 4, edge);
  Touching sheets(PETSC_COMM_WORLD, on_first(PETSC_COMM_WORLD, joined(half, half, {4 * edge, 0, 0})), touching());
  const auto throw_at = [&](double away, double across) {
    for (PetscInt i = 0; i < sheets.sheet.particles.local(); ++i) {
      const PetscInt id = sheets.sheet.persistent_id[i];
      const double from_seam = sheets.sheet.rest(0, i) - 4 * edge;
      const bool is_left = from_seam < -1e-6 || (from_seam < 1e-6 && id < static_cast<PetscInt>(half.points.size()));
      sheets.velocities.vector(i) = Eigen::Vector3d(is_left ? -away : away, 0, id % 2 == 0 ? across : -across);
    }
  };
  throw_at(0.5, 0);
  bool have_closed = false;
  for (int n = 0; n < 60; ++n) {
    if (n == 10) {
      throw_at(-1, 0.2);
    }
    sheets.advance(1e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    ASSERT_EQ(sheets.crossings(), 0) << "step " << n;
    const ContactFigures figures = sheets.contact->figures(sheets.positions);
    have_closed = have_closed || (n > 10 && figures.contacts > 0 && figures.smallest_gap < 0.1 * 5e-3);
  }
  EXPECT_TRUE(have_closed) << "at a tenth of the thickness nothing else presses";
}

TEST(Contact, StepsDoNotDependOnTheRanks) {
  const auto run = [](MPI_Comm comm) {
    Touching sheets(comm, on_first(comm, two_sheets(0.012)), touching(0.3));
    for (PetscInt i = 0; i < sheets.sheet.particles.local(); ++i) {
      sheets.velocities.vector(i) = Eigen::Vector3d(0.5, 0, sheets.sheet.rest(2, i) > 0 ? -3 : 0);
    }
    for (int n = 0; n < 10; ++n) {
      sheets.advance(1e-3);
    }
    EXPECT_GT(sheets.contact->figures(sheets.positions).contacts, 0);
    return by_id(sheets.sheet, sheets.positions);
  };
  EXPECT_LT((run(PETSC_COMM_SELF) - run(PETSC_COMM_WORLD)).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(Contact, TwoBalloonsPressWithTheirPressureOnTheFlatDisc) {
  constexpr double radius = 0.05;
  constexpr double gap = 2e-3;
  Options options;
  options.force.gravity.setZero();
  options.prism.mass_damping = 20;
  options.wall.thickness = 3e-4;
  options.wall.material.law = "neo_hookean";
  options.wall.material.mu = 4e5;
  options.wall.bending = "none";
  options.prism.newton = "converged";
  options.prism.snes_rtol = 1e-6;
  options.contact.self = true;
  options.contact.friction = 0.2;  // else one rolls off the other
  options.contact.thickness = 1e-3;
  ChamberOptions& gas = options.chambers["gas"];
  gas.law = "isothermal";
  gas.amount_ratio = Rows{{0, 1}, {0.2, 1.06}};
  for (const double side : {-1.0, 1.0}) {
    PinOptions& pin = options.pins[side < 0 ? "left" : "right"];
    pin.centre = {side * (2 * radius + gap / 2), 0, 0};
    pin.radius = 0.2 * radius;
    pin.path = Rows{{0.2, 0, 0, 0}, {0.5, -side * 0.4 * radius, 0, 0}};
  }
  SurfaceMesh mesh = icosphere_mesh(3, radius);
  const auto first_points = static_cast<PetscInt>(mesh.points.size());
  mesh = moved(joined(mesh, mesh, {2 * radius + gap, 0, 0}), {-(radius + gap / 2), 0, 0});
  StaticBalloon balloons(on_first(PETSC_COMM_WORLD, mesh), options);
  for (int n = 1; n <= 60; ++n) {
    balloons.reach(0.01 * n);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    ASSERT_EQ(find_crossings({{balloons.membrane(), balloons.state().position, nullptr}}).pairs, 0);
  }
  const Membrane& membrane = balloons.membrane();
  Eigen::Matrix3Xd push = Eigen::Matrix3Xd::Zero(3, membrane.particles.owned);
  balloons.contact()->add_gradient(balloons.state().position, push);
  std::vector<double> areas(membrane.particles.local(), 0.0);
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    const std::array<PetscInt, 3>& corners = membrane.triangles[e];
    const auto at = [&](std::size_t k) { return balloons.state().position.vector(corners[k]); };
    for (const PetscInt i : corners) {
      areas[i] += (at(1) - at(0)).cross(at(2) - at(0)).norm() / 6;
    }
  }
  // The disc is what bears more than half of the pressure: at its edge, in the middle of a vertex's surroundings, less.
  std::array<double, 2> sums{};  // force on the first balloon, area of its disc
  for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
    const double area = areas[i];
    if (membrane.persistent_id[i] < first_points) {
      sums[0] += push(0, i);
      sums[1] += push(0, i) > 0.5 * balloons.pressure() * area ? area : 0;
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_GT(sums[1], 0.1 * M_PI * radius * radius);
  EXPECT_NEAR(sums[0], balloons.pressure() * sums[1], 0.06 * sums[0]);
}

}  // namespace
}  // namespace pellicle
