#include "elastic/elastic_step.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "base/error.h"
#include "parallel/collective.h"
#include "solvers/backtracking.h"
#include "solvers/shell_operations.h"
#include "surface/net_strain.h"

namespace pellicle {
inline namespace elastic {

namespace {

/// Stiffness over inertia above which solves with rigid patches cost less than with the diagonal's blocks alone.
constexpr double worth_patches = 600;
/// Share of the forces that is left, from which on Newton's method is quadratic: further away the exact tangent is
/// seldom positive definite, or no better. With much contact a smaller share, in the wind a larger one saves a little.
constexpr double error_near_end = 0.1;
/// Tolerance below which that saves iterations: with fewer digits to go the method ends before.
constexpr double worth_exact = 1e-2;

}  // namespace

ElasticStep::ElasticStep(const Sheet& sheet, const SheetMaterial& material, double layer_distance,
                         const MaterialFactors& factors, const std::vector<bool>& pinned,
                         const std::vector<bool>& clamped, const ElasticOptions& options,
                         const std::vector<Potential*>& others)
    : ElasticStep(sheet, stiffness_of(material), weave_of(sheet, material.warp), factors, pinned, clamped, options,
                  others) {
  damping_ = material.damping;
  layer_distance_ = layer_distance;
  make_solver();
}

ElasticStep::ElasticStep(const Sheet& sheet, const Stiffness& stiffness, const Weave& weave,
                         const MaterialFactors& factors, const std::vector<bool>& pinned,
                         const std::vector<bool>& clamped, const ElasticOptions& options,
                         const std::vector<Potential*>& others)
    : MassPart(sheet, pinned, options.newton_tolerance, options.usual_h, others),
      sheet_(sheet),
      options_(options),
      bending_stiffness_(stiffness.bending),
      bending_factor_(factors.bending),
      material_(sheet, stiffness, weave, factors),
      springs_(sheet),
      bending_(sheet, weave, clamped),
      gradient_(3, sheet.particles.owned) {
  potentials_.insert(potentials_.begin(), {&springs_, &bending_});
  sums_.resize(potentials_.size() + 2);
  limits_ = std::any_of(others.begin(), others.end(), [](const Potential* other) { return other->limits(); });
  if (options.strain_limit) {
    limit_ = StrainLimit{*options.strain_limit, std::max(stiffness.tensile[0], stiffness.tensile[1])};
  }
  if (bending_factor_.empty()) {
    bending_factor_.assign(static_cast<std::size_t>(sheet.particles.local()), 1);
  }
}

void ElasticStep::make_solver() {
  tangent_ = std::make_unique<Tangent>(sheet_.particles, potentials_, projectors_, TangentMatrix::shell, "");
  if (options_.mat_type != TangentMatrix::shell) {
    assembled_ = std::make_unique<Tangent>(sheet_.particles, potentials_, projectors_, options_.mat_type,
                                           options_.solver_prefix);
  }
  const RestTangent rest = rest_tangent();
  rest_stiffness_ = rest.mean_square;
  force_scale_ = rest_stiffness_ * place_;
  KspDefaults defaults;
  if (options_.mat_type == TangentMatrix::sbaij) {
    defaults.preconditioner = PCBJACOBI;
  } else {
    defaults.preconditioner = rest.over_inertia < worth_patches ? PCPBJACOBI : PCMG;
  }
  defaults.rtol = 1e-2;
  defaults.max_iterations = 10000;
  defaults.single_reduction = true;
  defaults.fields = {"x", "y", "z"};
  const Tangent& preconditioning = assembled_ != nullptr ? *assembled_ : *tangent_;
  solver_ = make_ksp(tangent_->matrix(), preconditioning.matrix(), options_.solver_prefix, defaults);
  patches_ = RigidPatches::of(solver_, preconditioning, sheet_.triangles, options_.patch_size);
  check(MatCreateVecs(tangent_->matrix(), update_.create(), residual_.create()));
  KSPType type = nullptr;
  PCType preconditioner = nullptr;
  PC pc = nullptr;
  char words[200];
  check(KSPGetType(solver_, &type));
  check(KSPGetPC(solver_, &pc));
  check(PCGetType(pc, &preconditioner));
  std::snprintf(words, sizeof words, "%s, %s%s: stiffness is %.2g times inertia", type, preconditioner,
                patches_ != nullptr ? " with rigid patches" : "", rest.over_inertia);
  solver_words_ = words;
}

ElasticStep::RestTangent ElasticStep::rest_tangent() {
  const auto particles = static_cast<std::size_t>(sheet_.particles.local());
  std::array<std::vector<double>, 4> length;
  for (const Colour colour : all_colours) {
    length[static_cast<std::size_t>(colour)] = sheet_.of(colour).initial_length;
  }
  Field rest(sheet_.particles, 3);
  rest.values() = sheet_.rest;
  const std::vector<double> ones(particles, 1);
  const std::vector<bool> none(particles);
  const Living all(sheet_);
  const ElasticInput input{{sheet_.initial_mass, none, rest, options_.usual_h}, length, ones, ones, all};
  set_shape(input);
  set_masses(rest, input);
  tangent_->update(rest, Curvature::positive);
  VecHandle diagonal;
  check(MatCreateVecs(tangent_->matrix(), diagonal.create(), nullptr));
  double sum = 0;
  double norm = 0;
  check(MatGetDiagonal(tangent_->matrix(), diagonal));
  check(VecSum(diagonal, &sum));
  check(VecNorm(diagonal, NORM_2, &norm));
  double inertia = 3 * std::accumulate(inertia_.stiffness().begin(), inertia_.stiffness().end(), 0.0);
  MPI_Allreduce(MPI_IN_PLACE, &inertia, 1, MPI_DOUBLE, MPI_SUM, sheet_.comm());
  return {norm / std::sqrt(3.0 * sheet_.particles.global), inertia > 0 ? sum / inertia : 0};
}

void ElasticStep::set_shape(const ElasticInput& input) {
  const double damping = damping_ / input.h;
  const std::array<std::vector<double>, 4>& stiffness = material_.stiffness(input.living);
  const auto factor_at = [&input](PetscInt i) { return input.stiffness_factor[static_cast<std::size_t>(i)]; };
  springs_.set([&](Colour colour, std::size_t s) -> SpringPotential::Hooke {
    const auto index = static_cast<std::size_t>(colour);
    const SpringSet& set = sheet_.of(colour);
    const double intact = stiffness[index][s];
    if (intact == 0) {
      return {0, set.initial_length[s]};
    }
    const auto [a, b] = set.ends[s];
    const double k = intact * (factor_at(a) + factor_at(b)) / 2;
    const double l = input.target_length[index][s];
    return {k, l, {damping * k, damping > 0 ? (input.start.vector(a) - input.start.vector(b)).norm() : 0}};
  });
  springs_.set_limit(limit_, input.target_length, input.living.springs);

  bent_factor_.resize(bending_factor_.size());
  std::transform(bending_factor_.begin(), bending_factor_.end(), input.stiffness_factor.begin(), bent_factor_.begin(),
                 std::multiplies<>());
  bending_.begin_step(input.living, input.start,
                      {input.shrinkage, layer_distance_, bending_stiffness_, bent_factor_, damping});
}

double ElasticStep::largest_excess() const {
  double excess = material_.largest_excess();
  MPI_Allreduce(MPI_IN_PLACE, &excess, 1, MPI_DOUBLE, MPI_MAX, sheet_.comm());
  return excess;
}

std::array<std::vector<bool>, 4> ElasticStep::bearing_springs(const Living& living) {
  std::array<std::vector<bool>, 4> bears;
  const std::array<std::vector<double>, 4>& stiffness = material_.stiffness(living);
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    for (std::size_t s = 0; s < static_cast<std::size_t>(sheet_.of(colour).owned()); ++s) {
      bears[index].push_back(stiffness[index][s] > 0);
    }
  }
  return bears;
}

double ElasticStep::elastic_energy(const Field& positions) const {
  double sum = springs_.elastic_energy(positions) + bending_.value(positions) - bending_.viscous_energy(positions);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, sheet_.comm());
  return sum;
}

double ElasticStep::viscous_work(const Field& positions) const {
  double sum = -2 * (springs_.viscous_energy(positions) + bending_.viscous_energy(positions));
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, sheet_.comm());
  return sum;
}

ElasticStep::Forces ElasticStep::compute_forces(const Field& x, const std::vector<bool>& held) {
  gradient_.setZero();
  sums_[0] = 0;
  for (std::size_t k = 0; k < potentials_.size(); ++k) {
    part_.setZero();
    sums_[0] += potentials_[k]->add_value_and_gradient(x, part_);
    for (Eigen::Index i = 0; i < part_.cols(); ++i) {
      if (held[static_cast<std::size_t>(i)]) {
        part_.col(i).setZero();
      }
    }
    sums_[k + 2] = part_.squaredNorm();
    gradient_ += part_;
  }
  sums_[1] = gradient_.squaredNorm();
  MPI_Allreduce(MPI_IN_PLACE, sums_.data(), static_cast<int>(sums_.size()), MPI_DOUBLE, MPI_SUM, sheet_.comm());
  return {sums_[0], std::sqrt(sums_[1]), std::sqrt(*std::max_element(sums_.begin() + 2, sums_.end()))};
}

LinearResult ElasticStep::find_update(const Field& positions, bool is_exact) {
  const bool is_cheap = assembled_ == nullptr && patches_ == nullptr;
  const bool is_due = is_cheap || lag_.due(solver_);
  if (!is_exact || is_due) {
    tangent_->update(positions, Curvature::positive);
  }
  if (is_due) {
    lag_.renewed();
    if (assembled_ != nullptr) {
      assembled_->update(positions, Curvature::positive);
    }
    if (patches_ != nullptr) {
      patches_->renew(positions);
    }
  }
  check(KSPSetReusePreconditioner(solver_, is_due ? PETSC_FALSE : PETSC_TRUE));
  copy_to(residual_, gradient_.reshaped());
  if (!is_exact) {
    return solve(solver_, residual_, update_);
  }
  tangent_->update(positions, Curvature::exact);
  LinearResult result = solve(solver_, residual_, update_);
  if (!result.converged) {
    const int iterations = result.iterations;
    tangent_->update(positions, Curvature::positive);
    check(KSPSetReusePreconditioner(solver_, PETSC_FALSE));
    result = solve(solver_, residual_, update_);
    result.iterations += iterations;
  }
  return result;
}

/// A preconditioner made from an assembled tangent is of no use for another pattern; rigid patches still serve.
void ElasticStep::forget_pattern() {
  if (assembled_ != nullptr) {
    lag_.forget();
  }
  if (patches_ != nullptr) {
    patches_->forget_pattern();
  }
}

void ElasticStep::begin(const Field& positions, const ElasticInput& input) {
  set_shape(input);
  MassPart::begin(positions, input);
}

ElasticResult ElasticStep::advance(Field& positions, const ElasticInput& input) {
  lag_.forget();  // A step depends on its start alone, so that one tried again, or one after a restart, is the same.
  set_shape(input);
  set_masses(positions, input);
  ElasticResult result;
  for (Potential* potential : potentials_) {
    potential->start_from(input.start, positions, input.h);
  }
  bool stays_behind = false;
  for (PetscInt i = 0; limits_ && i < sheet_.particles.owned; ++i) {
    stays_behind =
        stays_behind || (input.held[static_cast<std::size_t>(i)] && positions.vector(i) != inertia_.free().col(i));
  }
  if (limits_ && on_any_rank(sheet_.comm(), stays_behind)) {
    result.converged = false;
    result.reason = "what is pinned moves further in a step than what is near it allows";
    return result;
  }
  settle(positions, input, result);
  if (limit_) {
    if (const NetStrain strain = net_strain(sheet_, positions, input.target_length, input.living);
        !(strain.largest <= limit_->largest)) {
      const std::string solved = result.converged ? "where all forces are in balance" : result.reason;
      result.converged = false;
      result.reason = beyond_limit(strain, limit_->largest) + ": " + solved;
    }
  }
  return result;
}

void ElasticStep::settle(Field& positions, const ElasticInput& input, ElasticResult& result) {
  bool goes_on = true;
  while (goes_on) {
    result.converged = true;
    result.reason.clear();
    minimise(positions, input, result);
    goes_on = false;
    for (Potential* potential : potentials_) {  // Also after a failure: with another energy the method may end.
      goes_on = potential->renew(positions) || goes_on;
    }
  }
}

void ElasticStep::minimise(Field& positions, const ElasticInput& input, ElasticResult& result) {
  const double rounding_of_forces = rounding();
  Forces forces = compute_forces(positions, input.held);
  bool exact_serves = options_.newton_tolerance < worth_exact;
  for (int iteration = 0;; ++iteration) {
    result.error = forces.norm <= rounding_of_forces ? 0 : forces.norm / forces.largest_part;
    if (result.error <= options_.newton_tolerance) {
      return;
    }
    result.converged = false;
    if (!std::isfinite(forces.norm)) {
      result.reason = "forces on the sheet are not finite";
      return;
    }
    if (iteration == options_.newton_iterations) {
      char text[200];
      std::snprintf(
          text, sizeof text,
          "Newton's method has left %.2e of the forces after %d iterations, expected elastic.newton_tolerance "
          "%.2e",
          result.error, iteration, options_.newton_tolerance);
      result.reason = text;
      return;
    }
    stop_.pass();
    leave_if_stopped();
    if (tangent_->move_on(positions)) {
      forget_pattern();
    }
    const bool is_exact = exact_serves && result.error <= error_near_end;
    const LinearResult solved = find_update(positions, is_exact);
    result.iterations += solved.iterations;
    if (!solved.converged) {
      result.reason = solved.reason;
      return;
    }
    const double* update = nullptr;
    check(VecGetArrayRead(update_, &update));
    step_ = -Eigen::Map<const Eigen::Matrix3Xd>(update, 3, gradient_.cols());
    check(VecRestoreArrayRead(update_, &update));
    for (Eigen::Index i = 0; i < step_.cols(); ++i) {
      if (input.held[static_cast<std::size_t>(i)]) {
        step_.col(i).setZero();  // Some solvers leave rounding here.
      }
    }
    limit_step(sheet_.comm(), potentials_, positions, gradient_, step_);
    double slope = step_.cwiseProduct(gradient_).sum();
    MPI_Allreduce(MPI_IN_PLACE, &slope, 1, MPI_DOUBLE, MPI_SUM, sheet_.comm());
    before_.values() = positions.values();
    const double start_energy = forces.energy;
    const auto merit = [&](double share) -> std::optional<double> {
      positions.values().leftCols(step_.cols()) = before_.values().leftCols(step_.cols()) + share * step_;
      positions.update_ghosts();
      forces = compute_forces(positions, input.held);
      return std::isfinite(forces.energy) ? std::optional(forces.energy) : std::nullopt;
    };
    constexpr double rounding = 1e-12;
    ++result.newton_iterations;
    if (slope < 0 && backtrack(std::cref(merit), start_energy, -slope, rounding * std::abs(start_energy))) {
      result.converged = true;
    } else if (is_exact) {  // It need not be positive definite, which some solvers do not notice.
      exact_serves = false;
      merit(0);
    } else {
      result.reason = "no part of Newton's step lowers the energy of the sheet";
      return;
    }
  }
}

}  // namespace elastic
}  // namespace pellicle
