#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <map>

#include "elastic/spring_potential.h"
#include "geometry/principal_axes.h"
#include "surface/shell.h"
#include "surface/weave_strain.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/initial_lengths.h"
#include "tests/support/product.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

Sheet limited_sheet(MPI_Comm comm, const SurfaceMesh& mesh) {
  SheetOptions options;
  options.is_one_surface = true;
  options.areal_density = 1;
  return make_sheet(comm, mesh, options);
}

TEST(StrainLimitTest, SlopeAndCurvatureAreTheDerivativesOfTheEnergy) {
  const StrainLimit limit{0.1, 3, 0.9};
  const double target = 0.02;
  for (const double strain : {-0.3, -0.1, -0.099, -0.09, -0.05, 0.0, 0.079, 0.085, 0.0979, 0.0981, 0.2, 5.0}) {
    const double d = target * (1 + strain);
    const double h = 1e-8 * target;
    const StrainLimit::Law law = limit.at(d, target);
    const StrainLimit::Law above = limit.at(d + h, target);
    const StrainLimit::Law below = limit.at(d - h, target);
    const double tolerance = 1e-6 * (1 + limit.at(target * (1 + strain), target).curvature);
    EXPECT_NEAR((above.value - below.value) / (2 * h), law.slope, tolerance * target) << strain;
    EXPECT_NEAR((above.slope - below.slope) / (2 * h), law.curvature, tolerance) << strain;
    EXPECT_GE(law.curvature, 0) << strain;
    EXPECT_GE(law.slope * strain, 0) << "it draws back: " << strain;
  }
}

TEST(StrainLimitTest, NothingActsBelowItsBeginAndNoCurvatureJumps) {
  const StrainLimit limit{0.1, 3, 0.9};
  EXPECT_EQ(limit.at(1.0799, 1).value, 0);
  for (const double strain : {0.08, 0.098, -0.08, -0.098}) {  // where it begins, and where it is continued
    EXPECT_NEAR(limit.at(1 + strain * (1 - 1e-9), 1).curvature, limit.at(1 + strain * (1 + 1e-9), 1).curvature,
                1e-6 * (1 + limit.at(1 + strain, 1).curvature))
        << strain;
  }
  const StrainLimit stretched_only{1.5, 3, 0.9};
  EXPECT_EQ(stretched_only.at(0, 1).slope, 0);
}

TEST(StrainLimitTest, ItGrowsWithoutBoundTowardsTheLimit) {
  StrainLimit limit{0.1, 3, 0};
  double before = 0;
  for (const double fraction : {0.9, 0.99, 0.999}) {
    limit.exact_to = fraction;
    const double slope = limit.at(1.08 + 0.02 * fraction, 1).slope;
    EXPECT_NEAR(slope, 3 * 0.02 * fraction * fraction * (3 - fraction) / std::pow(1 - fraction, 3), 1e-6 * slope);
    EXPECT_GT(slope, 500 * before);
    before = slope;
  }
}

/// Springs of a sheet pulled out of shape, of which some are beyond a limit.
struct Pulled {
  explicit Pulled(MPI_Comm comm = PETSC_COMM_SELF)
      : sheet(limited_sheet(comm, grid_mesh(3, 2, 0.1))), x(sheet.particles, 3), springs(sheet), active(sheet) {
    std::vector<bool>& blue = active.springs[static_cast<std::size_t>(Colour::blue)];
    for (std::size_t s = 0; s < blue.size(); ++s) {
      blue[s] = sheet.persistent_id[sheet.of(Colour::blue).ends[s][0]] != 0;
    }
    springs.set([this](Colour colour, std::size_t s) {
      return SpringPotential::Hooke{colour == Colour::yellow ? 0.0 : 5.0, sheet.of(colour).initial_length[s]};
    });
    springs.set_limit(StrainLimit{0.1, 5, 0.8}, initial_lengths(sheet), active.springs);
    x.values() = sheet.rest;
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      const auto id = static_cast<double>(sheet.persistent_id[i]);
      x.vector(i) += 0.009 * Eigen::Vector3d(std::sin(7 * id), std::sin(11 * id + 1), std::sin(13 * id + 2));
    }
  }
  Eigen::VectorXd gradient() const {
    Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, sheet.particles.owned);
    springs.add_gradient(x, result);
    return Eigen::Map<Eigen::VectorXd>(result.data(), result.size());
  }
  Eigen::MatrixXd hessian(double psd_blend) {
    springs.update_hessian(x, psd_blend);
    const Eigen::Index size = 3 * sheet.particles.owned;
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size, size);
    for (Eigen::Index k = 0; k < size; ++k) {
      const Eigen::VectorXd unit = Eigen::VectorXd::Unit(size, k);
      result.col(k) = product_of(springs, sheet.particles.owned, unit.reshaped(3, sheet.particles.owned)).reshaped();
    }
    return result;
  }

  Sheet sheet;
  Field x;
  SpringPotential springs;
  ActiveSet active;
};

TEST(StrainLimitTest, TheLargestShareIsThatOfAllRanks) {
  const Pulled whole;
  const Pulled divided(PETSC_COMM_WORLD);
  EXPECT_EQ(divided.springs.largest_share(divided.x), whole.springs.largest_share(whole.x));
}

TEST(StrainLimitTest, GradientAndHessianOfTheSpringsAreDerivatives) {
  Pulled pulled;
  EXPECT_GT(pulled.springs.largest_share(pulled.x), 0.9);
  const Eigen::VectorXd gradient = pulled.gradient();
  const Eigen::MatrixXd hessian = pulled.hessian(Curvature::exact);
  const double h = 1e-7;
  for (Eigen::Index k = 0; k < gradient.size(); ++k) {
    double& value = pulled.x.data()[k];
    const double here = value;
    value = here + h;
    const double energy_above = pulled.springs.value(pulled.x);
    const Eigen::VectorXd above = pulled.gradient();
    value = here - h;
    const double energy_below = pulled.springs.value(pulled.x);
    const Eigen::VectorXd below = pulled.gradient();
    value = here;
    EXPECT_NEAR((energy_above - energy_below) / (2 * h), gradient[k], 1e-6 * gradient.cwiseAbs().maxCoeff()) << k;
    EXPECT_LT(((above - below) / (2 * h) - hessian.col(k)).norm(), 1e-5 * hessian.norm()) << k;
  }
}

TEST(StrainLimitTest, ThePositiveHessianIsPositiveAndAtLeastTheExactOne) {
  Pulled pulled;
  const Eigen::MatrixXd positive = pulled.hessian(Curvature::psd);
  const Eigen::MatrixXd left_out = positive - pulled.hessian(Curvature::exact);
  const double scale = positive.norm();
  EXPECT_GT(principal_axes(positive).values.minCoeff(), -1e-12 * scale);
  EXPECT_GT(principal_axes(left_out).values.minCoeff(), -1e-12 * scale);
}

TEST(StrainLimitTest, WhatHasDiedHasNoLimit) {
  Pulled pulled;
  const auto blue = static_cast<std::size_t>(Colour::blue);
  for (auto& springs : pulled.active.springs) {
    springs.assign(springs.size(), false);
  }
  pulled.springs.set_limit(StrainLimit{0.1, 5, 0.8}, initial_lengths(pulled.sheet), pulled.active.springs);
  EXPECT_EQ(pulled.springs.largest_share(pulled.x), 0);
  const auto& [a, b] = pulled.sheet.springs[blue].ends[0];
  const double stretch =
      (pulled.x.vector(a) - pulled.x.vector(b)).norm() - pulled.sheet.springs[blue].initial_length[0];
  EXPECT_NEAR(pulled.springs.forces(pulled.x)[blue][0], 5 * stretch, 1e-12) << "but its own stiffness";
}

}  // namespace
}  // namespace pellicle
