#include "heat/conduction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/units.h"
#include "linear/ksp.h"
#include "linear/shell_operations.h"
#include "parallel/collective.h"

namespace pellicle::heat {

Conduction::Conduction(const Surface& surface, const HeatOptions& options,
                       const std::vector<double>& diffusivity_factor)
    : surface_(surface),
      options_(options),
      assembled_(options.mat_type == HeatMatrix::aij ||
                 (options.mat_type == HeatMatrix::automatic && asks_for_entries(options.solver_prefix))),
      diffusivity_(surface.particles.local(), options.diffusivity),
      product_(surface.particles.owned),
      exchange_(surface.particles, 1),
      estimate_(surface.particles, 1) {
  for (std::size_t i = 0; i < diffusivity_factor.size(); ++i) {
    diffusivity_[i] *= diffusivity_factor[i];
  }
  graph_.pairs = options.operator_name == HeatOperator::umbrella ? umbrella_pairs(surface) : cotangent_pairs(surface);
  if (assembled_) {
    create_assembled();
  } else {
    const Layout& particles = surface.particles;
    check(MatCreateShell(surface.comm(), particles.owned, particles.owned, particles.global, particles.global, this,
                         matrix_.create()));
    set_shell_operation<&Conduction::multiply_vector>(matrix_, MATOP_MULT);
    set_shell_operation<&Conduction::copy_diagonal>(matrix_, MATOP_GET_DIAGONAL);
  }
  set_definite(matrix_);
  set_matrix_options(matrix_, options.solver_prefix);
  check(MatCreateVecs(matrix_, increment_.create(), right_hand_side_.create()));

  KspDefaults defaults;
  defaults.preconditioner = PCJACOBI;
  defaults.rtol = options.ksp_rtol;
  defaults.fields = {"temperature"};
  defaults.divtol = 1e20;  // Where conduction is fast, conjugate gradients pass through large residuals.
  ksp_ = make_ksp(matrix_, matrix_, options.solver_prefix, defaults);
}

void Conduction::create_assembled() {
  const Layout& particles = surface_.particles;
  // Each rank writes the rows of its own particles: their diagonal, then what lies beside it, pair by pair.
  std::vector<PetscInt> rows;
  std::vector<PetscInt> columns;
  for (PetscInt i = 0; i < particles.owned; ++i) {
    rows.push_back(particles.to_global(i));
    columns.push_back(particles.to_global(i));
  }
  for (const auto& [a, b] : graph_.pairs) {
    for (const auto& [row, column] : {std::pair(a, b), std::pair(b, a)}) {
      if (row < particles.owned) {
        rows.push_back(particles.to_global(row));
        columns.push_back(particles.to_global(column));
      }
    }
  }
  entries_.resize(rows.size());
  check(MatCreate(surface_.comm(), matrix_.create()));
  check(MatSetSizes(matrix_, particles.owned, particles.owned, particles.global, particles.global));
  check(MatSetType(matrix_, MATAIJ));
  check(MatSetPreallocationCOO(matrix_, static_cast<PetscCount>(rows.size()), rows.data(), columns.data()));
}

void Conduction::update_operator(const ConductionInput& input) {
  if (options_.operator_name == HeatOperator::umbrella) {
    set_umbrella(graph_, surface_, diffusivity_, input.positions, input.active);
  } else {
    set_cotangent(graph_, surface_, diffusivity_, input.positions, input.mass, input.active);
  }
  const PetscInt owned = surface_.particles.owned;
  sum_.setZero(surface_.particles.local());
  for (std::size_t p = 0; p < graph_.pairs.size(); ++p) {
    graph_.weights[p] *= input.time_step;
    sum_[graph_.pairs[p][0]] += graph_.weights[p];
    sum_[graph_.pairs[p][1]] += graph_.weights[p];
  }
  diagonal_ = graph_.capacity + sum_.head(owned);
  for (Eigen::Index i = 0; i < owned; ++i) {
    if (diagonal_[i] == 0) {  // The particle has left: any capacity keeps its temperature.
      graph_.capacity[i] = diagonal_[i] = 1;
    }
  }

  if (assembled_) {
    std::copy(diagonal_.begin(), diagonal_.end(), entries_.begin());
    auto entry = entries_.begin() + owned;
    for (std::size_t p = 0; p < graph_.pairs.size(); ++p) {
      for (const PetscInt end : graph_.pairs[p]) {
        if (end < owned) {
          *entry++ = -graph_.weights[p];
        }
      }
    }
    check(MatSetValuesCOO(matrix_, entries_.data(), INSERT_VALUES));
  } else {
    // Tells the preconditioner that the diagonal has changed.
    check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
  }
}

void Conduction::copy_diagonal(Vec out) const { copy_to(out, diagonal_); }

void Conduction::multiply_vector(Vec x, Vec product) { multiply(ConstVecValues(x).data(), VecValues(product).data()); }

void Conduction::multiply(const double* x, double* product) {
  const PetscInt owned = surface_.particles.owned;
  const Eigen::Map<const Eigen::VectorXd> given(x, owned);
  Eigen::Map<Eigen::VectorXd>(exchange_.data(), owned) = given;
  exchange_.update_ghosts();
  graph_.add_up_inflow(exchange_, sum_);  // -h K x
  Eigen::Map<Eigen::VectorXd>(product, owned) = graph_.capacity.cwiseProduct(given) - sum_.head(owned);
  check(PetscLogFlops(2.0 * static_cast<double>(owned)));
}

double Conduction::limit_of_remainder(const Field& temperature) const {
  std::array<double, 3> largest{-HUGE_VAL, -HUGE_VAL, 1};  // temperature, minus temperature, and stiffness
  for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
    if (diagonal_[i] > graph_.capacity[i]) {
      const double value = temperature.data()[i];
      largest = {std::max(largest[0], value), std::max(largest[1], -value),
                 std::max(largest[2], diagonal_[i] / graph_.capacity[i])};
    }
  }
  largest = max_over_ranks(surface_.comm(), largest);
  const double range = std::max(0.0, largest[0] + largest[1]);
  const double highest = std::max({0.0, largest[0], largest[1]});
  const double rounding = 4 * std::numeric_limits<double>::epsilon();
  // Where conduction is fast, rounding alone makes temperatures differ so much that more heat than this is exchanged.
  return options_.ksp_rtol * range + std::min(rounding * largest[2], std::max(rounding, options_.ksp_rtol)) * highest;
}

StageResult Conduction::advance(Field& temperature, const ConductionInput& input) {
  if (!(options_.diffusivity > 0)) {  // All temperatures stay.
    return {};
  }
  update_operator(input);
  const double limit = limit_of_remainder(temperature);
  const PetscInt owned = surface_.particles.owned;
  Eigen::Map<Eigen::VectorXd> before(temperature.data(), owned);
  Eigen::Map<Eigen::VectorXd> after(estimate_.data(), owned);
  estimate_.values() = temperature.values();
  constexpr int most_solves = 20;
  StageResult result;
  double largest = 0;
  for (int solves = 0; solves < most_solves; ++solves) {
    // The heat that flows at the estimated temperatures and is not yet in them.
    graph_.add_up_inflow(estimate_, sum_);
    remainder_ = sum_.head(owned) - graph_.capacity.cwiseProduct(after - before);
    copy_to(right_hand_side_, remainder_);
    if (!result.add(solve(ksp_, right_hand_side_, increment_))) {
      return result;
    }
    const ConstVecValues increment(increment_);
    multiply(increment.data(), product_.data());
    remainder_ = (remainder_ - product_).cwiseQuotient(graph_.capacity);
    largest = owned > 0 ? remainder_.cwiseAbs().maxCoeff() : 0;
    largest = max_over_ranks(surface_.comm(), largest);
    if (largest <= limit) {
      before = after + (increment + remainder_);
      temperature.update_ghosts();
      return result;
    }
    after += increment;
    estimate_.update_ghosts();
  }
  result.converged = false;
  result.reason = "the linear solver " + options_.solver_prefix + " leaves errors of " + number_text(largest) +
                  " K after " + std::to_string(most_solves) + " solves, expected at most " + number_text(limit) +
                  " K by heat.ksp_rtol " + number_text(options_.ksp_rtol);
  return result;
}

}  // namespace pellicle::heat
