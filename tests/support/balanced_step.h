#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "elastic/spring_sheet.h"
#include "energies/newton_options.h"
#include "energies/step_objective.h"
#include "equilibrium/implicit_step.h"
#include "parallel/collective.h"
#include "tests/support/initial_lengths.h"

namespace pellicle {

/// Steps of a sheet's part, which are brought into balance alone.
/// @tparam Part a SpringSheet or an ElasticSheet, made with the arguments
template <class Part>
class BalancedStep {
 public:
  template <class... Arguments>
  explicit BalancedStep(const NewtonOptions& options, const Arguments&... arguments)
      : part(arguments...),
        objective_({&part}, {}, options.mat_type, options.solver_prefix),
        solver_(objective_, options) {}

  /// @param positions in: to which the sheet would go without forces; out: at the end of the step
  ImplicitResult advance(Field& positions, const SheetInput& input) {
    part.begin(positions, input);
    const ImplicitResult result = solver_.advance(input.h, factorised_);
    positions.values() = part.position().values();
    return result;
  }

  Part part;

 private:
  StepObjective objective_;
  ImplicitStep solver_;
  FactorisedSteps factorised_;
};

/// A sheet in motion without heat: external force, springs, velocity update.
/// @tparam Part as for BalancedStep
template <class Part>
class MovingSheet {
 public:
  /// @param arguments of the part after the sheet
  template <class... Arguments>
  MovingSheet(const Sheet& sheet, std::vector<bool> pinned, const NewtonOptions& options, const Arguments&... arguments)
      : positions(sheet.particles, 3),
        velocities(sheet.particles, 3),
        sheet_(sheet),
        step_(options, sheet, arguments...),
        pinned_(std::move(pinned)),
        ones_(pinned_.size(), 1),
        start_(sheet.particles, 3) {
    positions.values() = sheet.rest;
  }

  ImplicitResult advance(double h, const Eigen::Vector3d& gravity = {0, 0, 0}, double damping = 0) {
    start_.values() = positions.values();
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      if (!pinned_[i]) {
        velocities.vector(i) = std::exp(-damping * h) * velocities.vector(i) + h * gravity;
        positions.vector(i) += h * velocities.vector(i);
      }
    }
    unconstrained = positions.values();
    const ImplicitResult result = step_.advance(
        positions, {{sheet_.initial_mass, start_, h}, initial_lengths(sheet_), ones_, ones_, ActiveSet(sheet_)});
    EXPECT_TRUE(result.converged) << result.reason;
    velocities.values() = (positions.values() - start_.values()) / h;
    return result;
  }

  /// Kinetic energy of all ranks [J].
  double kinetic_energy() const {
    double sum = 0;
    for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
      sum += 0.5 * sheet_.initial_mass[i] * velocities.vector(i).squaredNorm();
    }
    return sum_over_ranks(sheet_.comm(), sum);
  }

  /// Sum of mass times `values` of the owned particles of all ranks.
  Eigen::Vector3d weighted_sum(const Eigen::Matrix3Xd& values) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
      sum += sheet_.initial_mass[i] * values.col(i);
    }
    sum_over_ranks(sheet_.comm(), sum);
    return sum;
  }
  Eigen::Vector3d momentum() const { return weighted_sum(velocities.values()); }

  /// Sets velocities that depend on the persistent ids only.
  void stir(double speed) {
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      const auto id = static_cast<double>(sheet_.persistent_id[i]);
      velocities.vector(i) = speed * Eigen::Vector3d(std::sin(7 * id), std::sin(11 * id + 1), std::sin(13 * id + 2));
    }
  }

  Field positions;
  Field velocities;
  Eigen::Matrix3Xd unconstrained;  ///< to which the last step would have led without forces

 protected:
  const Sheet& sheet_;
  BalancedStep<Part> step_;

 private:
  std::vector<bool> pinned_;
  std::vector<double> ones_;
  Field start_;
};

}  // namespace pellicle
