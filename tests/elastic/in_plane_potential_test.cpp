#include "elastic/in_plane_potential.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "elastic/sheet_geometry.h"
#include "geometry/pi.h"
#include "parallel/collective.h"
#include "surface/shell.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/product.h"

namespace pellicle::in_plane_potential_test {
namespace {

constexpr double width = 0.8;
constexpr double height = 0.6;

/// A flat rectangle of cells whose inner points are moved by up to `shake` of a cell, sheared by `skew`.
Sheet flat_sheet(MPI_Comm comm, double shake, double skew = 0) {
  SurfaceMesh mesh = grid_mesh(8, 6, 0.1);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    Eigen::Vector3d& point = mesh.points[i];
    const bool is_inner = point.x() > 0.05 && point.x() < width - 0.05 && point.y() > 0.05 && point.y() < height - 0.05;
    const auto number = static_cast<double>(i);
    if (is_inner) {
      point += 0.1 * shake * Eigen::Vector3d(std::sin(7 * number), std::sin(11 * number + 1), 0);
    }
    point.x() += skew * point.y();
  }
  SheetOptions options;
  options.layers = 1;
  return make_sheet(comm, mesh, options);
}

Stiffness cloth() {
  Stiffness stiffness;
  stiffness.tensile = {900, 400};
  stiffness.shear = 150;
  stiffness.poisson_ratio = 0.2;
  return stiffness;
}

/// A sheet that is strained.
struct Strained {
  Strained(Sheet made, const Stiffness& stiffness, const Eigen::Vector3d& warp, const MaterialFactors& factors = {})
      : sheet(std::move(made)),
        ones(sheet.particles.local(), 1),
        active(sheet),
        x(sheet.particles, 3),
        potential(sheet, stiffness, warp, factors) {
    x.values() = sheet.rest;
    begin(ones);
  }
  void begin(const std::vector<double>& shrinkage, double damping_over_step = 0) {
    potential.begin_step(active, x, {shrinkage, ones, damping_over_step});
  }
  void move(const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& place) {
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      x.vector(i) = place(sheet.rest.col(i));
    }
  }
  /// Moves every particle by up to `size` in a way that depends on its id.
  void shake(double size) {
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      const auto id = static_cast<double>(sheet.persistent_id[i]);
      x.vector(i) += size * Eigen::Vector3d(std::sin(7 * id), std::sin(11 * id + 1), std::sin(13 * id + 2));
    }
  }
  double energy() const { return sum_over_ranks(sheet.comm(), potential.value(x)); }
  Eigen::Matrix3Xd gradient() const {
    Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, sheet.particles.owned);
    potential.add_gradient(x, result);
    return result;
  }

  Sheet sheet;
  std::vector<double> ones;
  ActiveSet active;
  Field x;
  InPlanePotential potential;
};

/// Second Piola-Kirchhoff stress of the material under Green's strain, in the same axes.
Eigen::Matrix2d stress_of(const Stiffness& of, double angle_of_warp, const Eigen::Matrix2d& strain) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(angle_of_warp).toRotationMatrix();
  const Eigen::Matrix2d e = turn.transpose() * strain * turn;
  const double normal = 1 / (1 - of.poisson_ratio * of.poisson_ratio);
  const double c12 = of.poisson_ratio * std::sqrt(of.tensile[0] * of.tensile[1]);
  Eigen::Matrix2d stress;
  stress(0, 0) = normal * (of.tensile[0] * e(0, 0) + c12 * e(1, 1));
  stress(1, 1) = normal * (of.tensile[1] * e(1, 1) + c12 * e(0, 0));
  stress(0, 1) = stress(1, 0) = 2 * of.shear * e(0, 1);
  return turn * stress * turn.transpose();
}

// On meshes that are skewed by up to 45 degrees, on shaken ones, and in any direction of the warp.
TEST(InPlane, AnEvenStrainHasTheEnergyOfTheMaterialAndItsInsideIsInBalance) {
  Eigen::Matrix2d gradient;
  gradient << 1.05, 0.08, -0.03, 0.97;
  const Eigen::Matrix2d strain = (gradient.transpose() * gradient - Eigen::Matrix2d::Identity()) / 2;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (const auto& [shake, skew] : {std::pair(0.0, 0.0), {0.0, 1.0}, {0.25, 0.0}, {0.2, 0.5}}) {
    for (const double angle : {0.0, pi / 6, pi / 4, 2.0}) {
      Strained sheet(flat_sheet(PETSC_COMM_WORLD, shake, skew), cloth(), {std::cos(angle), std::sin(angle), 0});
      sheet.move([&](const Eigen::Vector3d& r) -> Eigen::Vector3d {
        Eigen::Vector3d flat(0, 0, 0);
        flat.head<2>() = gradient * r.head<2>();
        return turn * flat;
      });
      const Eigen::Matrix2d stress = stress_of(cloth(), angle, strain);
      const double expected = width * height * (stress * strain).trace() / 2;
      EXPECT_NEAR(sheet.energy(), expected, 1e-10 * expected) << shake << " " << skew << " " << angle;

      // The Cauchy stress is F S F^T / det F.
      Eigen::Matrix3d cauchy = Eigen::Matrix3d::Zero();
      cauchy.topLeftCorner<2, 2>() = gradient * stress * gradient.transpose() / gradient.determinant();
      cauchy = turn * cauchy * turn.transpose();
      for (const Eigen::Matrix3d& of_cell : sheet.potential.stress(sheet.x)) {
        EXPECT_LT((of_cell - cauchy).norm(), 1e-9 * cauchy.norm());
      }

      const Eigen::Matrix3Xd forces = sheet.gradient();
      const double scale = 0.1 * stress.norm();
      for (PetscInt i = 0; i < sheet.sheet.particles.owned; ++i) {
        const double y = sheet.sheet.rest(1, i);
        const double column = sheet.sheet.rest(0, i) - skew * y;
        if (column > 0.01 && column < width - 0.01 && y > 0.01 && y < height - 0.01) {
          ASSERT_LT(forces.col(i).norm(), 1e-10 * scale) << shake << " " << skew << " " << angle;
        }
      }
    }
  }
}

TEST(InPlane, ASheetThatHasShrunkEvenlyIsAtRestInItsSmallerShape) {
  Strained sheet(flat_sheet(PETSC_COMM_WORLD, 0.2), cloth(), {1, 1, 0});
  sheet.begin(std::vector<double>(sheet.ones.size(), 0.9));
  sheet.move([](const Eigen::Vector3d& r) -> Eigen::Vector3d { return 0.9 * r; });
  EXPECT_NEAR(sheet.energy(), 0, 1e-14);
  // Strains are measured from there, areas, too: by a tenth more it is like the whole one.
  sheet.move([](const Eigen::Vector3d& r) -> Eigen::Vector3d { return 0.9 * 1.1 * r; });
  Strained whole(flat_sheet(PETSC_COMM_WORLD, 0.2), cloth(), {1, 1, 0});
  whole.move([](const Eigen::Vector3d& r) -> Eigen::Vector3d { return 1.1 * r; });
  EXPECT_NEAR(sheet.energy(), 0.81 * whole.energy(), 1e-12 * whole.energy());
}

TEST(InPlane, TexturesActOnWhatTheyAreOf) {
  const auto energy = [](const MaterialFactors& factors, double e11, double e12) {
    Strained sheet(flat_sheet(PETSC_COMM_WORLD, 0), cloth(), {1, 0, 0}, factors);
    sheet.move([&](const Eigen::Vector3d& r) {
      return Eigen::Vector3d((1 + e11) * r.x() + e12 * r.y(), r.y() + e12 * r.x(), 0);
    });
    return sheet.energy();
  };
  const std::vector<double> half(flat_sheet(PETSC_COMM_WORLD, 0).particles.local(), 0.5);
  constexpr double small = 1e-6;
  EXPECT_NEAR(energy({half, {}, {}}, small, 0), energy({}, small, 0) / 2, 1e-4 * energy({}, small, 0));
  EXPECT_NEAR(energy({{}, half, {}}, small, 0), energy({}, small, 0), 1e-4 * energy({}, small, 0));
  EXPECT_NEAR(energy({half, {}, {}}, 0, small), energy({}, 0, small), 1e-4 * energy({}, 0, small));
  EXPECT_NEAR(energy({{}, half, {}}, 0, small), energy({}, 0, small) / 2, 1e-4 * energy({}, 0, small));
}

/// A sheet out of shape, with cells of which triangles are gone, uneven shrinkage and viscosity.
Strained crumpled(MPI_Comm comm) {
  Strained sheet(flat_sheet(comm, 0.2), cloth(), {3, 1, 0});
  for (std::size_t t = 0; t < sheet.active.triangles.size(); ++t) {
    const PetscInt cell = sheet.sheet.element_id[t / 4];
    sheet.active.triangles[t] = cell != 9 && (cell != 20 || t % 4 == 1) && (cell != 21 || t % 4 != 3);
  }
  std::vector<double> shrinkage;
  for (const PetscInt id : sheet.sheet.persistent_id) {
    shrinkage.push_back(0.9 + 0.05 * std::sin(5.0 * id));
  }
  sheet.shake(0.01);
  sheet.begin(shrinkage, 3);
  sheet.shake(0.013);
  return sheet;
}

TEST(InPlane, TheGradientIsTheDerivativeOfTheEnergyAndTheHessianItsOwn) {
  Strained sheet = crumpled(PETSC_COMM_SELF);
  const PetscInt count = sheet.sheet.particles.local();
  const Eigen::Matrix3Xd before = sheet.x.values();
  Eigen::Matrix3Xd direction(3, count);
  for (PetscInt i = 0; i < count; ++i) {
    direction.col(i) << std::sin(3.0 * i), std::cos(5.0 * i), std::sin(7.0 * i + 1);
  }
  const Eigen::Matrix3Xd gradient = sheet.gradient();
  sheet.potential.update_hessian(sheet.x, Curvature::exact);
  const Eigen::Matrix3Xd product = product_of(sheet.potential, count, direction);
  const std::vector<VertexPair> pattern = sheet.potential.pattern();
  Eigen::Matrix3Xd by_blocks = Eigen::Matrix3Xd::Zero(3, count);
  const auto take = [&](std::size_t pair, const Eigen::Matrix3d& block) {
    by_blocks.col(pattern[pair].row) += block * direction.col(pattern[pair].column);
  };
  sheet.potential.add_hessian(TakenPairs(take));
  EXPECT_LT((by_blocks - product).norm(), 1e-12 * product.norm());

  constexpr double h = 1e-6;
  sheet.x.values() = before + h * direction;
  const double above = sheet.energy();
  const Eigen::Matrix3Xd gradient_above = sheet.gradient();
  sheet.x.values() = before - h * direction;
  const double below = sheet.energy();
  const Eigen::Matrix3Xd change = (gradient_above - sheet.gradient()) / (2 * h);
  EXPECT_NEAR((above - below) / (2 * h), gradient.cwiseProduct(direction).sum(), 1e-6 * gradient.norm());
  EXPECT_LT((change - product).norm(), 1e-6 * product.norm());
}

TEST(InPlane, ThePositiveHessianIsPositiveAndThatOfASheetInTensionExact) {
  const auto hessian = [](Strained& sheet, double psd_blend) {
    const PetscInt size = 3 * sheet.sheet.particles.local();
    sheet.potential.update_hessian(sheet.x, psd_blend);
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size, size);
    const std::vector<VertexPair> pattern = sheet.potential.pattern();
    const auto take = [&](std::size_t pair, const Eigen::Matrix3d& block) {
      result.block<3, 3>(3 * pattern[pair].row, 3 * pattern[pair].column) += block;
    };
    sheet.potential.add_hessian(TakenPairs(take));
    return result;
  };
  Strained sheet = crumpled(PETSC_COMM_SELF);
  using Solver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
  const Eigen::VectorXd exact = Solver(hessian(sheet, Curvature::exact)).eigenvalues();
  const Eigen::VectorXd positive = Solver(hessian(sheet, Curvature::psd)).eigenvalues();
  EXPECT_LT(exact[0], -1e-3 * positive.tail<1>()[0]);
  EXPECT_GT(positive[0], -1e-12 * positive.tail<1>()[0]);

  Strained tight(flat_sheet(PETSC_COMM_SELF, 0.1), cloth(), {3, 1, 0});
  tight.move([](const Eigen::Vector3d& r) { return Eigen::Vector3d(1.1 * r.x(), 1.2 * r.y() + 0.02 * r.x(), 0); });
  const Eigen::MatrixXd wanted = hessian(tight, Curvature::exact);
  EXPECT_LT((hessian(tight, Curvature::psd) - wanted).norm(), 1e-12 * wanted.norm());
}

TEST(InPlane, ViscosityResistsChangesOfStrainAlone) {
  Strained sheet(flat_sheet(PETSC_COMM_WORLD, 0.1), cloth(), {1, 0, 0});
  sheet.begin(sheet.ones, 4);
  sheet.move([](const Eigen::Vector3d& r) { return Eigen::Vector3d(1.01 * r.x(), r.y(), 0); });
  const double elastic = sum_over_ranks(sheet.sheet.comm(), sheet.potential.elastic_energy(sheet.x));
  EXPECT_NEAR(sheet.energy(), 5 * elastic, 1e-12 * elastic);
  sheet.begin(sheet.ones, 4);
  EXPECT_NEAR(sheet.energy(), elastic, 1e-12 * elastic) << "at the start of a step";
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 1, 1).normalized()).toRotationMatrix();
  sheet.x.values() = turn * sheet.x.values();
  EXPECT_NEAR(sheet.energy(), elastic, 1e-10 * elastic) << "when it turns";
}

TEST(InPlane, AnyNumberOfRanksGivesTheSame) {
  const Strained alone = crumpled(PETSC_COMM_SELF);
  const Strained shared = crumpled(PETSC_COMM_WORLD);
  EXPECT_NEAR(shared.energy(), alone.energy(), 1e-13 * alone.energy());
  const Eigen::MatrixXd expected = by_id(alone.sheet, alone.gradient());
  EXPECT_LT((by_id(shared.sheet, shared.gradient()) - expected).norm(), 1e-12 * expected.norm());
}

TEST(InPlane, AWarpThatStandsUprightIsLaidDown) {
  const Sheet sheet = flat_sheet(PETSC_COMM_WORLD, 0);
  const Eigen::Matrix3Xd warp = warp_of(sheet, Eigen::Vector3d::UnitZ());
  for (Eigen::Index i = 0; i < sheet.particles.owned; ++i) {
    EXPECT_NEAR(warp.col(i).norm(), 1, 1e-14);
    EXPECT_NEAR(warp(2, i), 0, 1e-14);
  }
}

}  // namespace
}  // namespace pellicle::in_plane_potential_test
