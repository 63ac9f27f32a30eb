#include <gtest/gtest.h>
#include <petscsys.h>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <cstdio>
#include <vector>

#include "elastic/bending_stencils.h"
#include "elastic/sheet_springs.h"
#include "elastic/spring_sheet.h"
#include "surface/shell.h"
#include "tests/support/balanced_step.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/initial_lengths.h"

namespace pellicle::compliant_constraints_test {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;

/// The paper's way to a step, made compliant: springs of all colours and the second derivatives of the positions are
/// constraints C(x) = 0 of finite stiffness k with multipliers lambda = k C, all in one system,
///
///     (J W J^T + 1/(k h^2)) dlambda = (C - lambda/k) / h^2,    x = x~ - h^2 W J^T lambda,
///
/// which is solved until the multipliers, which add up, no longer change. At convergence this is implicit Euler.
class CompliantConstraints {
 public:
  CompliantConstraints(const Sheet& sheet, const SheetMaterial& material, const std::vector<bool>& pinned, double h)
      : h_(h), inverse_mass_(3 * sheet.particles.owned) {
    const Stiffness stiffness = stiffness_of(material);
    SheetSprings springs(sheet, stiffness, material.warp, MaterialFactors());
    const auto& of_springs = springs.stiffness(ActiveSet(sheet));
    for (const Colour colour : all_colours) {
      const SpringSet& set = sheet.of(colour);
      for (std::size_t s = 0; s < set.ends.size(); ++s) {
        if (const double k = of_springs[static_cast<std::size_t>(colour)][s]; k > 0) {
          springs_.push_back({set.ends[s][0], set.ends[s][1], set.initial_length[s]});
          stiffness_.push_back(k);
        }
      }
    }
    BendingStencils bending(sheet, material.warp, std::vector<bool>(pinned.size()));
    bending.update(ActiveSet(sheet));
    const Eigen::Array3d by_direction(stiffness.bending[0], 2 * std::sqrt(stiffness.bending[0] * stiffness.bending[1]),
                                      stiffness.bending[1]);
    for (const auto& stencil : bending.stencils()) {
      for (int k = 0; k < 3 && stencil.area > 0; ++k) {
        for (int axis = 0; axis < 3; ++axis) {
          for (std::size_t p = stencil.first; p < stencil.last; ++p) {
            linear_.emplace_back(static_cast<int>(stiffness_.size()), 3 * bending.points()[p] + axis,
                                 bending.weights()[p][k]);
          }
          stiffness_.push_back(stencil.area * by_direction[k]);
        }
      }
    }
    for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
      const auto particle = static_cast<std::size_t>(i);
      inverse_mass_.segment<3>(3 * i).setConstant(pinned[particle] ? 0 : 1 / sheet.initial_mass[particle]);
    }
  }

  /// @param x in: x~; out: at the end of the step @returns the number of linear solves
  int advance(Eigen::VectorXd& x) const {
    const Eigen::VectorXd free = x;
    Eigen::VectorXd multiplier = Eigen::VectorXd::Zero(count());
    Eigen::SimplicialLDLT<SparseMatrix> solver;
    for (int solves = 0; solves < 200; ++solves) {
      const SparseMatrix jacobian = derivative(x);
      const Eigen::VectorXd unmet = (values(x).array() - multiplier.array() / stiffness().array()).matrix();
      solver.compute(gram(jacobian));
      multiplier += solver.solve(unmet / (h_ * h_));
      const Eigen::VectorXd before = x;
      x = free - h_ * h_ * inverse_mass_.asDiagonal() * (jacobian.transpose() * multiplier);
      if ((x - before).norm() <= 1e-13 * x.norm()) {
        return solves + 1;
      }
    }
    ADD_FAILURE() << "the multipliers do not settle";
    return 0;
  }

  /// Multiplications in conjugate gradients to 1e-2 in the multipliers, over those in the positions.
  /// @param rows that count: of the springs alone, or all
  double cost_ratio(const Eigen::VectorXd& x, Eigen::Index rows) const {
    const SparseMatrix jacobian = derivative(x).topRows(rows);
    const Eigen::VectorXd k = stiffness().head(rows);
    const Eigen::VectorXd unmet = values(x).head(rows);
    SparseMatrix positions = jacobian.transpose() * k.asDiagonal() * jacobian;
    for (Eigen::Index i = 0; i < inverse_mass_.size(); ++i) {
      positions.coeffRef(i, i) += 1 / (std::max(inverse_mass_[i], 1e-6) * h_ * h_);
    }
    return cost(gram(jacobian), unmet) / cost(positions, jacobian.transpose() * (k.asDiagonal() * unmet));
  }
  Eigen::Index springs() const { return static_cast<Eigen::Index>(springs_.size()); }
  Eigen::Index count() const { return static_cast<Eigen::Index>(stiffness_.size()); }

 private:
  struct Spring {
    PetscInt a;
    PetscInt b;
    double length;
  };

  Eigen::Map<const Eigen::VectorXd> stiffness() const { return {stiffness_.data(), count()}; }

  Eigen::VectorXd values(const Eigen::VectorXd& x) const {
    SparseMatrix linear(count(), x.size());
    linear.setFromTriplets(linear_.begin(), linear_.end());
    Eigen::VectorXd result = linear * x;
    for (std::size_t s = 0; s < springs_.size(); ++s) {
      const auto& [a, b, length] = springs_[s];
      result[static_cast<Eigen::Index>(s)] = (x.segment<3>(3 * a) - x.segment<3>(3 * b)).norm() - length;
    }
    return result;
  }

  SparseMatrix derivative(const Eigen::VectorXd& x) const {
    std::vector<Eigen::Triplet<double>> entries = linear_;
    for (std::size_t s = 0; s < springs_.size(); ++s) {
      const auto& [a, b, length] = springs_[s];
      const Eigen::Vector3d direction = (x.segment<3>(3 * a) - x.segment<3>(3 * b)).normalized();
      for (int axis = 0; axis < 3; ++axis) {
        entries.emplace_back(static_cast<int>(s), 3 * a + axis, direction[axis]);
        entries.emplace_back(static_cast<int>(s), 3 * b + axis, -direction[axis]);
      }
    }
    SparseMatrix result(count(), x.size());
    result.setFromTriplets(entries.begin(), entries.end());
    return result;
  }

  SparseMatrix gram(const SparseMatrix& jacobian) const {
    SparseMatrix result = jacobian * inverse_mass_.asDiagonal() * SparseMatrix(jacobian.transpose());
    for (Eigen::Index i = 0; i < result.rows(); ++i) {
      result.coeffRef(i, i) += 1 / (stiffness()[i] * h_ * h_);
    }
    return result;
  }

  static double cost(const SparseMatrix& matrix, const Eigen::VectorXd& right_hand_side) {
    Eigen::ConjugateGradient<SparseMatrix, Eigen::Lower | Eigen::Upper> solver(matrix);
    solver.setTolerance(1e-2);
    solver.solve(right_hand_side).eval();
    return static_cast<double>(solver.iterations()) * static_cast<double>(matrix.nonZeros());
  }

  double h_;
  Eigen::VectorXd inverse_mass_;  ///< of each coordinate, 0 of pinned particles [1/kg]
  std::vector<Spring> springs_;
  std::vector<Eigen::Triplet<double>> linear_;  ///< rows of the derivative that do not depend on the positions
  std::vector<double> stiffness_;               ///< of the springs [N/m], then of the second derivatives [N m^3]
};

/// Steps a sheet that hangs by its left edge and is blown at, both ways. @returns the largest distance between the ends
double difference_after(int steps, double tensile, double bending, double h) {
  SheetOptions options;
  options.is_one_surface = true;
  options.areal_density = 1;
  const Sheet sheet = make_sheet(PETSC_COMM_SELF, grid_mesh(6, 4, 0.1), options);
  SheetMaterial material;
  material.tensile_stiffness = tensile;
  material.shear_stiffness = 0.4 * tensile;
  material.bending_stiffness = bending;
  material.damping = 0;
  ElasticOptions tight;
  tight.snes_rtol = 1e-11;
  tight.max_iterations = 200;
  tight.mat_type = TangentMatrix::aij;
  std::vector<bool> pinned;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    pinned.push_back(sheet.rest(0, i) < 1e-9);
  }
  const std::vector<double> ones(pinned.size(), 1);
  BalancedStep<ElasticSheet> elastic(tight, sheet, material, 0.01, MaterialFactors(), pinned,
                                     std::vector<bool>(pinned.size()), tight);
  const CompliantConstraints compliant(sheet, material, pinned, h);

  const Eigen::Index size = 3 * sheet.particles.owned;
  const Eigen::VectorXd rest = sheet.rest.reshaped();
  std::array<Eigen::VectorXd, 2> x{rest, rest};
  std::array<Eigen::VectorXd, 2> v{Eigen::VectorXd::Zero(size), Eigen::VectorXd::Zero(size)};
  Field start(sheet.particles, 3);
  Field positions(sheet.particles, 3);
  for (int n = 0; n < steps; ++n) {
    std::array<Eigen::VectorXd, 2> before = x;
    for (std::size_t displacement = 0; displacement < 2; ++displacement) {
      for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
        if (!pinned[i]) {
          v[displacement].segment<3>(3 * i) += h * Eigen::Vector3d(3, std::sin(5.0 * i), -9.81);
          x[displacement].segment<3>(3 * i) += h * v[displacement].segment<3>(3 * i);
        }
      }
    }
    start.values() = before[0].reshaped(3, sheet.particles.owned);
    positions.values() = x[0].reshaped(3, sheet.particles.owned);
    const ImplicitResult result = elastic.advance(
        positions, {{sheet.initial_mass, start, h}, initial_lengths(sheet), ones, ones, ActiveSet(sheet)});
    EXPECT_TRUE(result.converged) << result.reason;
    x[0] = positions.values().reshaped();
    if (n + 1 == steps) {
      const double ratio = compliant.cost_ratio(x[1], compliant.count());
      EXPECT_GT(ratio, 2);
      std::printf(
          "%g N/m, %g N m: a solve in the multipliers costs %.2g times one in the positions, %.2g without bending\n",
          tensile, bending, ratio, compliant.cost_ratio(x[1], compliant.springs()));
    }
    compliant.advance(x[1]);
    for (std::size_t displacement = 0; displacement < 2; ++displacement) {
      v[displacement] = (x[displacement] - before[displacement]) / h;
    }
  }
  return (x[0] - x[1]).lpNorm<Eigen::Infinity>();
}

TEST(CompliantConstraints, LeadToWhereImplicitEulerOfTheElasticSheetDoes) {
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  if (ranks > 1) {
    GTEST_SKIP() << "each rank would do the same";
  }
  EXPECT_LT(difference_after(3, 100, 1e-3, 0.01), 1e-8);
  EXPECT_LT(difference_after(3, 1000, 1e-1, 0.01), 1e-8);
  EXPECT_LT(difference_after(3, 1e5, 1, 0.005), 1e-8);
}

}  // namespace
}  // namespace pellicle::compliant_constraints_test
