#include "contact/surface_contact.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <cmath>

#include "contact/crossings.h"
#include "energies/tangent.h"
#include "linear/shell_operations.h"
#include "meshing/triangulation.h"
#include "surface/membrane.h"
#include "surface/shell.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

constexpr double thickness = 0.01;  // [m]
constexpr double edge = 0.05;       // of the grid [m]
constexpr double stiffness = 4e6;   // [Pa/m]

/// A strip rolled up, so that its layers are nearer to each other than the thickness and parts of it are near others
/// that are far along the strip.
Eigen::Vector3d rolled(const Eigen::Vector3d& place, double layer_gap) {
  constexpr double inner = 0.06;
  const double growth = layer_gap / (2 * M_PI);
  // Along the spiral r = inner + growth * angle, whose length is about inner * angle + growth * angle^2 / 2.
  const double angle = (std::sqrt(inner * inner + 2 * growth * place.x()) - inner) / growth;
  const double radius = inner + growth * angle;
  return {radius * std::cos(angle), place.y(), radius * std::sin(angle)};
}

class SurfaceContactTest : public ::testing::TestWithParam<bool> {
 protected:
  SurfaceContactTest() {
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank_);
    const SurfaceMesh mesh = rank_ == 0 ? irregular_grid() : SurfaceMesh();
    if (GetParam()) {
      sheet_ = std::make_unique<Sheet>(make_sheet(PETSC_COMM_WORLD, mesh, SheetOptions()));
    } else {
      membrane_ = std::make_unique<Membrane>(
          make_membrane(PETSC_COMM_WORLD, rank_ == 0 ? triangulated(mesh) : mesh, SheetOptions()));
    }
  }

  static SurfaceMesh irregular_grid() {
    SurfaceMesh mesh = grid_mesh(24, 5, edge);
    for (Eigen::Vector3d& point : mesh.points) {
      point.x() += 0.2 * edge * std::sin(100 * point.x() + 37 * point.y());
      point.y() += 0.2 * edge * std::cos(53 * point.x() - 91 * point.y());
    }
    return mesh;
  }

  const Surface& surface() const { return sheet_ != nullptr ? static_cast<const Surface&>(*sheet_) : *membrane_; }

  Field roll(double layer_gap) const {
    Field x(surface().particles, 3);
    for (PetscInt i = 0; i < surface().particles.local(); ++i) {
      x.vector(i) = rolled(surface().rest.col(i), layer_gap);
    }
    return x;
  }

  double sum(double value) const {
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return value;
  }

  Eigen::Matrix3Xd gradient(const SurfaceContact& contact, const Field& x) const {
    Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, surface().particles.owned);
    contact.add_gradient(x, result);
    return result;
  }

  /// A direction that depends on the particles' places in the file alone.
  Field direction() const {
    Field w(surface().particles, 3);
    for (PetscInt i = 0; i < surface().particles.local(); ++i) {
      const Eigen::Vector3d place = surface().rest.col(i);
      w.vector(i) = Eigen::Vector3d(std::sin(200 * place.x() + 1), std::cos(170 * place.y()),
                                    std::sin(90 * place.x() - 230 * place.y()));
    }
    return w;
  }

  /// Rubbing contact in a roll whose layers overlap, once its particles have moved a little.
  Field press(SurfaceContact& contact) const {
    const Field start = roll(0.6 * thickness);
    Field x = roll(0.6 * thickness);
    contact.start_from(start, x, 1e-3);
    x.values() += 2e-4 * direction().values();
    return x;
  }

  int crossings(const Field& x) const { return find_crossings({{surface(), x, nullptr}}).pairs; }

  int rank_ = 0;
  std::unique_ptr<Sheet> sheet_;
  std::unique_ptr<Membrane> membrane_;
  ContactOptions options_;
};

TEST_P(SurfaceContactTest, FlatSurfaceDoesNotTouchItself) {
  SurfaceContact contact({{&surface(), thickness, stiffness}}, options_, true);
  Field start(surface().particles, 3);
  start.values() = surface().rest;
  Field x(surface().particles, 3);
  x.values() = start.values();
  contact.start_from(start, x, 1e-3);
  EXPECT_EQ(sum(contact.value(x)), 0);
  EXPECT_EQ(contact.figures(x).contacts, 0);
}

TEST_P(SurfaceContactTest, WhereAPartMovesFurtherThePairsAreThoseOfAFreshSearch) {
  const Field start = roll(0.6 * thickness);
  Field x = roll(0.6 * thickness);
  SurfaceContact contact({{&surface(), thickness, stiffness}}, options_, false);
  contact.start_from(start, x, 1e-3);
  const PetscInt owned = surface().particles.owned;
  for (const double first : {0.0, 0.5}) {  // of the strip's length: two parts, one after the other
    Eigen::Matrix3Xd step = Eigen::Matrix3Xd::Zero(3, owned);
    const Field w = direction();
    for (PetscInt i = 0; i < owned; ++i) {
      const double along = surface().rest(0, i) / (24 * edge);
      if (along >= first && along < first + 0.4) {
        step.col(i) = 0.2 * thickness * w.vector(i);
      }
    }
    contact.limit(x, StepLimit::each_vertex, step);
    x.values().leftCols(owned) += step;
    x.update_ghosts();
  }
  EXPECT_EQ(contact.figures(x).searches, 3);
  SurfaceContact fresh({{&surface(), thickness, stiffness}}, options_, false);
  Field end(surface().particles, 3);
  end.values() = x.values();
  fresh.start_from(start, end, 1e-3);
  EXPECT_GT(contact.figures(x).contacts, 100);
  EXPECT_EQ(contact.figures(x).contacts, fresh.figures(x).contacts);
  const double expected = sum(fresh.value(x));
  EXPECT_NEAR(sum(contact.value(x)), expected, 1e-12 * expected);
  EXPECT_LT((gradient(contact, x) - gradient(fresh, x)).norm(), 1e-12 * gradient(fresh, x).norm());
}

TEST_P(SurfaceContactTest, SurfacesThatAreTooNearArePushedApartAndTheGhostsWithThem) {
  SurfaceMesh mesh = rank_ == 0 ? triangulated(irregular_grid()) : SurfaceMesh();
  for (Eigen::Vector3d& point : mesh.points) {
    point.z() += 1;  // Where undeformed surfaces touch they do not press.
  }
  const Membrane upper = make_membrane(PETSC_COMM_WORLD, mesh, SheetOptions());
  SurfaceContact contact({{&surface(), thickness, stiffness}, {&upper, thickness, stiffness}}, options_, false);
  const JoinedLayout& joined = contact.joined();
  Field x(joined.layout(), 3);
  for (std::size_t part = 0; part < 2; ++part) {
    const Surface& own = part == 0 ? surface() : upper;
    Field place(own.particles, 3);
    place.values() = own.rest;
    place.values().row(2).array() += part == 0 ? 0 : 0.6 * thickness - 1;
    joined.put(part, place, x);
    contact.set_surface(std::vector<bool>(static_cast<std::size_t>(own.particles.local())), nullptr, part);
  }
  const Eigen::Matrix3Xd before = x.values();
  contact.push_apart(x);
  EXPECT_GT(sum((x.values() - before).norm()), 0.1 * thickness);
  EXPECT_GE(contact.figures(x).smallest_gap, 0.9 * thickness);
  const Eigen::Matrix3Xd pushed = x.values();
  x.update_ghosts();
  EXPECT_EQ((x.values() - pushed).norm(), 0);
}

TEST_P(SurfaceContactTest, ForcesAreMinusTheGradientAndInBalance) {
  options_.friction = 0.5;
  options_.slip_speed = 1;
  SurfaceContact contact({{&surface(), thickness, stiffness}}, options_, true);
  const Field x = press(contact);
  const Field w = direction();
  EXPECT_GT(sum(contact.value(x)), 0);

  const Eigen::Matrix3Xd here = gradient(contact, x);
  constexpr double step = 1e-8;
  Field moved(surface().particles, 3);
  const auto value_at = [&](double fraction) {
    moved.values() = x.values() + fraction * w.values();
    return sum(contact.value(moved));
  };
  const double slope = (value_at(step) - value_at(-step)) / (2 * step);
  const double expected = sum(here.cwiseProduct(w.values().leftCols(here.cols())).sum());
  EXPECT_NEAR(slope, expected, 1e-6 * std::abs(expected));

  Eigen::Vector3d force = here.rowwise().sum();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  double size = here.cwiseAbs().sum();
  for (PetscInt i = 0; i < here.cols(); ++i) {
    moment += Eigen::Vector3d(x.vector(i)).cross(here.col(i));
  }
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(sum(force[c]), 0, 1e-12 * sum(size));
  }
  // Friction acts at the places where the step started.
  options_.friction = 0;
  SurfaceContact smooth({{&surface(), thickness, stiffness}}, options_, true);
  Field y = roll(0.6 * thickness);
  smooth.start_from(roll(0.6 * thickness), y, 1e-3);
  const Eigen::Matrix3Xd pushing = gradient(smooth, y);
  moment.setZero();
  for (PetscInt i = 0; i < here.cols(); ++i) {
    moment += Eigen::Vector3d(y.vector(i)).cross(pushing.col(i));
  }
  size = sum(pushing.cwiseAbs().sum());
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(sum(moment[c]), 0, 1e-12 * size);
  }
}

TEST_P(SurfaceContactTest, TheExactSecondDerivativeIsThatOfTheForces) {
  options_.friction = 0.5;
  options_.slip_speed = 1;
  SurfaceContact contact({{&surface(), thickness, stiffness}}, options_, true);
  Field x = press(contact);
  const Field w = direction();
  const Projectors projectors(static_cast<std::size_t>(surface().particles.local()));
  Tangent tangent(surface().particles, {&contact}, projectors, TangentMatrix::baij, "contact_test_");
  tangent.update_pattern(x);
  tangent.update_pattern(x);  // The direction of friction follows an iteration behind.
  tangent.update(x, Curvature::exact);
  VecHandle in;
  VecHandle out;
  check(MatCreateVecs(tangent.matrix(), in.create(), out.create()));
  copy_to(in, w.values().leftCols(surface().particles.owned).reshaped());
  check(MatMult(tangent.matrix(), in, out));
  const double* values = nullptr;
  check(VecGetArrayRead(out, &values));
  const Eigen::Matrix3Xd product = Eigen::Map<const Eigen::Matrix3Xd>(values, 3, surface().particles.owned);
  check(VecRestoreArrayRead(out, &values));

  constexpr double step = 1e-8;
  Field moved(surface().particles, 3);
  const auto gradient_at = [&](double fraction) {
    moved.values() = x.values() + fraction * w.values();
    return gradient(contact, moved);
  };
  const Eigen::Matrix3Xd expected = (gradient_at(step) - gradient_at(-step)) / (2 * step);
  const double size = std::sqrt(sum(expected.squaredNorm()));
  EXPECT_GT(size, 0);
  EXPECT_LT(std::sqrt(sum((product - expected).squaredNorm())), 1e-5 * size);
}

TEST_P(SurfaceContactTest, DoesNotDependOnTheRanks) {
  const auto everything = [&](MPI_Comm comm) {
    int rank = 0;
    MPI_Comm_rank(comm, &rank);
    const SurfaceMesh mesh = rank == 0 ? irregular_grid() : SurfaceMesh();
    std::unique_ptr<Sheet> sheet;
    std::unique_ptr<Membrane> membrane;
    if (GetParam()) {
      sheet = std::make_unique<Sheet>(make_sheet(comm, mesh, SheetOptions()));
    } else {
      membrane = std::make_unique<Membrane>(make_membrane(comm, rank == 0 ? triangulated(mesh) : mesh, SheetOptions()));
    }
    const Surface& surface = sheet != nullptr ? static_cast<const Surface&>(*sheet) : *membrane;
    SurfaceContact contact({{&surface, thickness, stiffness}}, options_, true);
    Field start(surface.particles, 3);
    for (PetscInt i = 0; i < surface.particles.local(); ++i) {
      start.vector(i) = rolled(surface.rest.col(i), 0.6 * thickness);
    }
    Field x(surface.particles, 3);
    x.values() = 1.01 * start.values();
    contact.start_from(start, x, 1e-3);
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, surface.particles.owned);
    contact.add_gradient(x, force);
    Eigen::MatrixXd result(7, surface.id_end);
    result.topRows<3>() = by_id(surface, force);
    result.middleRows<3>(3) = by_id(surface, x);
    double value = contact.value(x);
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, comm);
    result.row(6).setConstant(value);
    return result;
  };
  const Eigen::MatrixXd alone = everything(PETSC_COMM_SELF);
  const Eigen::MatrixXd together = everything(PETSC_COMM_WORLD);
  EXPECT_GT(alone(6, 0), 0);
  for (int row = 0; row < 7; ++row) {
    EXPECT_LT((alone.row(row) - together.row(row)).cwiseAbs().maxCoeff(), 1e-9 * alone.row(row).cwiseAbs().maxCoeff())
        << row;
  }
}

TEST_P(SurfaceContactTest, NothingPassesThroughAnything) {
  SurfaceContact contact({{&surface(), thickness, stiffness}}, options_, true);
  Field start = roll(1.5 * thickness);
  ASSERT_EQ(crossings(start), 0);
  Field through = roll(1.5 * thickness);
  through.values() *= -0.5;
  through.values().row(1) = start.values().row(1);
  for (PetscInt i = 0; i < surface().particles.local(); ++i) {
    if (surface().rest(0, i) > 12 * edge) {
      through.vector(i) = start.vector(i);
    }
  }
  ASSERT_GT(crossings(through), 0);
  // All layers are to go to the axis of the roll, and beyond.
  for (int step = 0; step < 4; ++step) {
    Field x(surface().particles, 3);
    x.values() = -0.5 * start.values();
    contact.start_from(start, x, 1e-3);
    for (int iteration = 0; iteration < 4; ++iteration) {
      contact.update_pattern(x);
      Eigen::Matrix3Xd whole = -x.values().leftCols(surface().particles.owned) * 1.5;
      const Eigen::Matrix3Xd given = whole;
      const StepLimit how = iteration % 2 == 0 ? StepLimit::each_vertex : StepLimit::all_alike;
      EXPECT_TRUE(contact.limit(x, how, whole));
      if (how == StepLimit::all_alike) {
        EXPECT_LE((whole * given.norm() - given * whole.norm()).norm(), 1e-12 * given.norm() * whole.norm())
            << "also what is not drawn";
      }
      for (PetscInt i = 0; i < surface().particles.owned; ++i) {
        x.vector(i) += whole.col(i);
      }
      x.update_ghosts();
      ASSERT_EQ(crossings(x), 0) << "step " << step << ", iteration " << iteration;
    }
    start.values() = x.values();
  }
}

// Folded once, with both layers in one plane and their vertices in common places; every fifth column is one point.
TEST_P(SurfaceContactTest, CoincidentVerticesAndDegenerateTrianglesStayFinite) {
  options_.friction = 0.3;
  SurfaceContact contact({{&surface(), thickness, stiffness}}, options_, true);
  Field start(surface().particles, 3);
  for (PetscInt i = 0; i < surface().particles.local(); ++i) {
    const double column = std::round(std::abs(surface().rest(0, i) / edge - 12));
    const bool is_point = static_cast<int>(column) % 5 == 0;
    start.vector(i) = Eigen::Vector3d(column * edge, is_point ? 0 : std::round(surface().rest(1, i) / edge) * edge, 0);
  }
  Field x(surface().particles, 3);
  x.values() = start.values();
  contact.start_from(start, x, 1e-3);
  for (int iteration = 0; iteration < 4; ++iteration) {
    EXPECT_TRUE(std::isfinite(sum(contact.value(x)))) << iteration;
    EXPECT_TRUE(gradient(contact, x).allFinite()) << iteration;
    EXPECT_TRUE(std::isfinite(contact.figures(x).smallest_gap)) << iteration;
    Eigen::Matrix3Xd step = 0.2 * thickness * direction().values().leftCols(surface().particles.owned);
    const double whole = step.norm();
    contact.limit(x, StepLimit::each_vertex, step);
    EXPECT_TRUE(step.allFinite());
    EXPECT_LE(step.norm(), whole);
    x.values().leftCols(step.cols()) += step;
    x.update_ghosts();
    contact.update_pattern(x);
  }
}

TEST_P(SurfaceContactTest, LatticePointsAreHeldBackWithTheirCorners) {
  if (!surface().has_quads()) {
    GTEST_SKIP() << "triangles have no lattice points";
  }
  std::vector<bool> constrained(surface().is_lattice.size());
  for (std::size_t i = 0; i < constrained.size(); ++i) {
    constrained[i] = surface().persistent_id[i] % 5 == 0;
  }
  SurfaceContact contact({{&surface(), thickness, stiffness}}, options_, false);
  contact.set_surface(constrained, nullptr);
  const Field start = roll(1.5 * thickness);
  Field x = roll(1.5 * thickness);
  contact.start_from(start, x, 1e-3);
  Eigen::Matrix3Xd step = -1.5 * x.values().leftCols(surface().particles.owned);
  Field back(surface().particles, 3);
  back.values().leftCols(step.cols()) = -step;
  ASSERT_TRUE(contact.limit(x, StepLimit::each_vertex, step));
  back.values().leftCols(step.cols()) += step;
  back.update_ghosts();
  double carried = 0;
  for (PetscInt e = 0; e < surface().elements.owned; ++e) {
    const PetscInt lattice = surface().lattice[e];
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const PetscInt corner : surface().cells[e]) {
      mean += back.vector(corner) / 4;
    }
    if (constrained[lattice]) {
      mean.setZero();
    }
    EXPECT_LT((back.vector(lattice) - mean).norm(), 1e-15) << "cell " << e;
    carried += mean.norm();
  }
  EXPECT_GT(sum(carried), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Meshes, SurfaceContactTest, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "quads" : "triangles"; });

}  // namespace
}  // namespace pellicle
