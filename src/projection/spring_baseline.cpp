#include "projection/spring_baseline.h"

#include <Eigen/Core>
#include <algorithm>
#include <tuple>
#include <utility>

#include "base/error.h"
#include "base/options.h"

namespace pellicle {

namespace {

using Block = Eigen::Matrix<PetscScalar, 3, 3, Eigen::RowMajor>;

/// Force of a spring on its first end, and minus the derivative of that force by the first end.
struct SpringForce {
  Eigen::Vector3d force;
  Block tangent;
};

/// @param arm x_a - x_b [m]
/// @param moved change of the arm during the step [m]
SpringForce spring_force(const Eigen::Vector3d& arm, const Eigen::Vector3d& moved, double target_length, double h,
                         const SpringOptions& options) {
  const double k = options.stiffness;
  const double c = k * options.damping / h;
  const double d = arm.norm();
  if (d == 0) {  // No direction: the spring is idle.
    return {Eigen::Vector3d::Zero(), Block::Zero()};
  }
  const Eigen::Vector3d n = arm / d;
  const Block along = n * n.transpose();
  return {-(k * (d - target_length) + c * n.dot(moved)) * n,
          (k + c) * along + k * std::max(0.0, 1 - target_length / d) * (Block::Identity() - along)};
}

}  // namespace

void describe(OptionTable& table, SpringOptions& options) {
  table.add("spring.stiffness", &options.stiffness)
      .unit("N/m")
      .more_than(0)
      .help("stiffness of every spring of the mass-spring sheet; the sheet's own does not depend on the cell size then. "
            "The default stretches a metre of 1 kg/m^2 by about 10 %, of office paper by 1 %, under its weight")
      .source("burning paper, section 8, Fig. 7 b, d");
  table.add("spring.damping", &options.damping)
      .unit("s")
      .at_least(0)
      .help("damping coefficient of every spring over its stiffness");
  table.add("spring.newton_steps", &options.newton_steps)
      .range(1, 100)
      .help("linear solves a time step; one is the usual linearised backward Euler");
}

SpringBaseline::SpringBaseline(const Sheet& sheet, std::vector<bool> pinned, const SpringOptions& options)
    : sheet_(&sheet), pinned_(std::move(pinned)), options_(options), unconstrained_(sheet.particles, 3) {
  const Layout& particles = sheet.particles;
  // Ghost springs too: they fill the rows of the particles that they end at here, so that no values travel.
  std::vector<std::pair<PetscInt, PetscInt>> blocks;
  for (const SpringSet& set : sheet.springs) {
    for (const auto& [a, b] : set.ends) {
      for (const auto& [row, column] : {std::pair{a, b}, std::pair{b, a}}) {
        if (row < particles.owned) {
          blocks.emplace_back(row, column);
        }
      }
    }
  }
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  std::vector<PetscInt> own_blocks(static_cast<std::size_t>(particles.owned), 1);
  std::vector<PetscInt> other_blocks(static_cast<std::size_t>(particles.owned), 0);
  for (const auto& [row, column] : blocks) {
    ++(column < particles.owned ? own_blocks : other_blocks)[static_cast<std::size_t>(row)];
  }
  check(MatCreateBAIJ(particles.comm, 3, 3 * particles.owned, 3 * particles.owned, PETSC_DETERMINE, PETSC_DETERMINE, 0,
                      own_blocks.data(), 0, other_blocks.data(), tangent_.create()));
  check(MatSetOption(tangent_, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  check(MatSetOption(tangent_, MAT_SPD, PETSC_TRUE));
  check(MatCreateVecs(tangent_, update_.create(), residual_.create()));

  check(KSPCreate(particles.comm, solver_.create()));
  check(KSPSetOptionsPrefix(solver_, "spring_"));
  check(KSPSetOperators(solver_, tangent_, tangent_));
  check(KSPSetType(solver_, KSPCG));
  check(KSPSetTolerances(solver_, 1e-6, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PC preconditioner = nullptr;
  check(KSPGetPC(solver_, &preconditioner));
  check(PCSetType(preconditioner, PCPBJACOBI));
  check(KSPSetFromOptions(solver_));
}

void SpringBaseline::assemble(const Field& positions, const Field& unconstrained, const SpringStep& step) {
  const Layout& particles = sheet_->particles;
  const auto add_block = [this, &particles](PetscInt row, PetscInt column, const Block& block) {
    const PetscInt global_row = particles.to_global(row);
    const PetscInt global_column = particles.to_global(column);
    check(MatSetValuesBlocked(tangent_, 1, &global_row, 1, &global_column, block.data(), ADD_VALUES));
  };
  check(MatZeroEntries(tangent_));
  PetscScalar* residual_values = nullptr;
  check(VecGetArrayWrite(residual_, &residual_values));
  Eigen::Map<Eigen::Matrix3Xd> residual(residual_values, 3, particles.owned);
  for (PetscInt i = 0; i < particles.owned; ++i) {
    const double inertia = step.mass[i] / (step.h * step.h);
    residual.col(i) = -inertia * (positions.vector(i) - unconstrained.vector(i));
    add_block(i, i, inertia * Block::Identity());
  }
  for (std::size_t colour = 0; colour < sheet_->springs.size(); ++colour) {
    const SpringSet& set = sheet_->springs[colour];
    for (PetscInt s = 0; s < set.local(); ++s) {
      const auto [a, b] = set.ends[static_cast<std::size_t>(s)];
      const Eigen::Vector3d arm = positions.vector(a) - positions.vector(b);
      const Eigen::Vector3d arm_at_start = step.start.vector(a) - step.start.vector(b);
      const SpringForce spring =
          spring_force(arm, arm - arm_at_start, step.target_length[colour][s], step.h, options_);
      for (const auto& [row, column, sign] : {std::tuple{a, b, 1.0}, std::tuple{b, a, -1.0}}) {
        // A pinned particle keeps its row of inertia alone, and leaves the others' rows: its update is zero.
        if (row >= particles.owned || pinned_[static_cast<std::size_t>(row)]) {
          continue;
        }
        residual.col(row) += sign * spring.force;
        add_block(row, row, spring.tangent);
        if (!pinned_[static_cast<std::size_t>(column)]) {
          add_block(row, column, -spring.tangent);
        }
      }
    }
  }
  check(VecRestoreArrayWrite(residual_, &residual_values));
  check(MatAssemblyBegin(tangent_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(tangent_, MAT_FINAL_ASSEMBLY));
}

StageResult SpringBaseline::advance(Field& positions, const SpringStep& step) {
  const PetscInt owned = sheet_->particles.owned;
  unconstrained_.values() = positions.values();
  StageResult result;
  for (int newton_step = 0; newton_step < options_.newton_steps; ++newton_step) {
    assemble(positions, unconstrained_, step);
    check(KSPSolve(solver_, residual_, update_));
    PetscInt iterations = 0;
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    check(KSPGetIterationNumber(solver_, &iterations));
    check(KSPGetConvergedReason(solver_, &reason));
    check(VecNorm(update_, NORM_INFINITY, &result.error));
    result.iterations += static_cast<int>(iterations);
    if (reason < 0) {
      result.converged = false;
      result.reason = std::string("springs: the linear solver ended with ") + KSPConvergedReasons[reason];
      return result;
    }
    const PetscScalar* update_values = nullptr;
    check(VecGetArrayRead(update_, &update_values));
    positions.values().leftCols(owned) += Eigen::Map<const Eigen::Matrix3Xd>(update_values, 3, owned);
    check(VecRestoreArrayRead(update_, &update_values));
    positions.update_ghosts();
  }
  return result;
}

}  // namespace pellicle
