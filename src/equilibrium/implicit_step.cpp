#include "equilibrium/implicit_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "base/error.h"
#include "linear/ksp.h"

namespace pellicle::equilibrium {

namespace {

/// Share by which an indefinite tangent is moved towards the positive one at a time; 1 is the positive one.
constexpr double share_step = 0.125;

/// Iterations of a linear solve before the tangent is factorised instead, at the cost of some 250
/// (docs/performance.md).
constexpr int most_linear_iterations = 100;

/// Rounding of forces over their scale.
constexpr double rounding_of_forces = 20 * std::numeric_limits<double>::epsilon();

/// Whether the tangent may be factorised if iterations fail: not if the user has chosen the solver.
bool may_factorise(const NewtonOptions& options, PetscInt vertices) {
  constexpr PetscInt most_vertices = 200000;  // Beyond, a factor takes too much memory unless the user asks for it.
  return options.factor == TangentFactorisation::automatic &&
         !any_is_given(options.solver_prefix, {"pc_type", "ksp_type", "ksp_max_it"}) &&
         options.mat_type != TangentMatrix::shell && vertices <= most_vertices;
}

/// Whether Newton's method may go on with a renewed energy: also after some failures.
bool may_go_on(const NewtonResult& newton) {
  return newton.ended > 0 || newton.ended == SNES_DIVERGED_MAX_IT || newton.ended == SNES_DIVERGED_LINE_SEARCH;
}

KspDefaults solver_defaults(const NewtonOptions& options, bool suits_patches, bool may_factorise) {
  constexpr double single_reductions_from = 1e-2;  // They save a reduction an iteration, but round more.
  KspDefaults defaults;
  const PCType with_all_entries = suits_patches ? PCMG : PCPBJACOBI;
  defaults.preconditioner = options.mat_type == TangentMatrix::sbaij ? PCBJACOBI : with_all_entries;
  defaults.rtol = options.linear_rtol();
  defaults.single_reduction = defaults.rtol >= single_reductions_from;
  defaults.max_iterations = may_factorise ? most_linear_iterations : 10000;
  defaults.fields = {"x", "y", "z"};
  return defaults;
}

}  // namespace

ImplicitStep::ImplicitStep(StepObjective& objective, const NewtonOptions& options)
    : options_(options),
      objective_(objective),
      along_(objective.path()),
      may_factorise_(may_factorise(options, objective.vertices().global)),
      system_(objective.tangent().matrix(), objective.columns(), options.solver_prefix,
              solver_defaults(options_, objective.suits_patches(), may_factorise_)) {
  // SNES needs a tolerance below 1. A part's own tolerance is used in the scaling of residuals.
  constexpr double largest_rtol = 0.5;
  options_.snes_rtol = std::min(options_.snes_rtol, largest_rtol);
  const PC pc = preconditioner_of(system_.solver());
  is_direct_ = has_type(system_.solver(), {KSPPREONLY});
  if (has_type(pc, {PCMG})) {
    patches_.emplace(system_.solver(), objective.tangent(), objective.triangles(), options.patch_size);
  }
  solver_words_ =
      options_.factor == TangentFactorisation::always
          ? "cg with a factorisation"
          : std::string(type_of(system_.solver())) + ", " + type_of(pc) + (patches_ ? " with rigid patches" : "");
  if (may_factorise_ || options_.factor == TangentFactorisation::always) {
    TangentFactor::check_options(objective.vertices().comm, options_.solver_prefix);
  }
  if (may_factorise_) {
    solver_words_ += "; with a factorisation where a solve takes more than " + std::to_string(most_linear_iterations) +
                     " iterations";
  }
  const Border* border = nullptr;
  if (!objective_.prescribed().empty()) {
    border = &bordered_.emplace(system_, objective_.prescribed(), objective_.pressure_scales());
  }
  if (along_ != nullptr) {
    border = &path_.emplace(system_);
  }
  Mat matrix = border != nullptr ? border->matrix() : system_.matrix();
  check(MatCreateVecs(matrix, unknowns_.create(), nullptr));
  if (objective.inverts()) {
    before_.emplace(objective.vertices(), 3);
  }
  // Rounding of positions leaves some 3 to 4 epsilon times this. It does not decrease with the elements' size, as their
  // stiffness does not. Steps of a balloon at rest end here.
  const double vertices = static_cast<double>(objective.vertices().global);
  rounding_ = rounding_of_forces * objective_.force_scale() * std::sqrt(vertices);
  NewtonDefaults defaults;
  defaults.fields = {{"x", "y", "z"}, "", 0};
  if (border != nullptr) {
    defaults.fields.border = path_ ? "load" : "pressure";
    defaults.fields.border_rows = border->border_rows();
  }
  defaults.atol = rounding_;
  defaults.rtol = options_.snes_rtol;
  check(KSPGetTolerances(system_.solver(), &defaults.ksp_rtol, nullptr, nullptr, nullptr));
  defaults.max_iterations = options.most_iterations();
  defaults.own_tangent = "-" + options_.solver_prefix + "mat_type shell";
  NewtonProblem problem;
  problem.residual = [this](Vec position, Vec residual) {
    objective_.move_to(position);
    objective_.compute_residual(residual);
  };
  problem.update_jacobian = [this](Vec position) {
    objective_.move_to(position);
    fraction_ = next_share();
    update_jacobian();
  };
  problem.solve = [this](Vec residual, Vec descent, const NewtonRequest& request) {
    linear_rtol_ = request.rtol;
    check(KSPSetTolerances(system_.solver(), request.rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
    const bool is_new = std::exchange(has_new_pattern_, false);
    check(KSPSetReusePreconditioner(system_.solver(), is_new ? PETSC_FALSE : reuses_preconditioner(request)));
    return solve(residual, descent);
  };
  if (options.line_search) {
    problem.search = [this](const NewtonStep& step) { return search(step); };
  }
  problem.rounding = [this] { return objective_.rounding(); };
  if (options.newton == NewtonEnd::converged) {
    problem.scale = [this] { return objective_.residual_scale(options_.snes_rtol); };
  }
  newton_.emplace(matrix, options.solver_prefix, std::move(problem), defaults);
}

ImplicitResult ImplicitStep::advance(double h, FactorisedSteps& factorised) {
  ImplicitResult result;
  if (!objective_.begin_step(h)) {
    result.converged = false;
    result.reason = "what is held moves further in a step than what is near it allows";
    return result;
  }
  objective_.write_to(unknowns_);
  // A step depends on its start alone, so that one after a restart is the same.
  lag_.forget();
  if (positive_ != nullptr) {
    positive_ = {};
    system_.forget_pattern();
  }
  concave_iterations_ = 0;
  has_failed_ = false;
  is_factorised_ = false;
  system_.use(nullptr);
  if (options_.factor == TangentFactorisation::always || factorised.left > 0) {
    factorise();
    factorised.left = std::max<PetscInt>(factorised.left - 1, 0);
  }
  NewtonResult newton;
  do {
    last_values_.clear();
    fraction_ = 0;
    exact_serves_ = true;
    newton = newton_->solve(unknowns_);
    result.newton_iterations += newton.iterations;
    result.linear_iterations += newton.linear_iterations;
    result.converged =
        newton.ended > 0 || (options_.newton == NewtonEnd::fixed && newton.ended == SNES_DIVERGED_MAX_IT);
    objective_.move_to(unknowns_);
  } while (may_go_on(newton) && objective_.refresh());
  result.concave_iterations = concave_iterations_;
  result.is_factorised = is_factorised_;
  if (has_failed_) {
    constexpr PetscInt most_in_a_row = 8;  // After so many factorised steps iterations are tried again.
    factorised.in_a_row = std::clamp<PetscInt>(2 * factorised.in_a_row, 1, most_in_a_row);
    factorised.left = factorised.in_a_row;
  } else if (!is_factorised_) {
    factorised.in_a_row = 0;  // Iterations were sufficient for the whole step.
  }
  if (result.converged) {
    judge(newton, result);
  } else {
    result.reason = words_of_failure(newton);
  }
  return result;
}

/// Checks the residual at which SNES has ended.
void ImplicitStep::judge(const NewtonResult& newton, ImplicitResult& result) {
  constexpr double negligible = 1e-6;  // of forces over their scale: they displace nothing by more of its size
  objective_.compute_residual(newton_->residual());  // SNES need not have computed it: with ksponly it has not.
  const double largest = objective_.residual_scale(options_.snes_rtol);
  check(VecNorm(newton_->residual(), NORM_2, &result.residual));
  result.relative_residual = result.residual / largest;
  result.over_tolerance = result.relative_residual / options_.snes_rtol;
  const double rounding = std::max(rounding_, objective_.rounding());
  const bool must_converge = options_.newton == NewtonEnd::converged;
  result.is_above_tolerance =
      result.residual > rounding &&
      result.relative_residual > (must_converge ? options_.snes_rtol : options_.residual_tolerance);
  if (!(result.residual <= std::max(newton.start_residual, rounding))) {
    result.reason = fmt::format("Newton's iterations made the residual grow, from {:.2e} N to {:.2e} N",
                                newton.start_residual, result.residual);
  } else if (newton.ended == SNES_CONVERGED_SNORM_RELATIVE && must_converge && result.residual > rounding &&
             result.relative_residual > options_.residual_tolerance) {
    result.reason = fmt::format("Newton's method goes no further at a residual of {:.2e} N, {:.1e} of the forces",
                                result.residual, result.relative_residual);
  } else if (newton.ended == SNES_CONVERGED_FNORM_ABS && result.over_tolerance > 1 &&
             result.residual > std::max(rounding, negligible / rounding_of_forces * rounding_)) {
    result.reason = fmt::format(
        "Newton's method ended by -{}snes_atol at a residual of {:.2e} N, {:.1e} of the forces, expected {:.1e}",
        options_.solver_prefix, result.residual, result.relative_residual, options_.snes_rtol);
  }
  result.converged = result.reason.empty();
}

std::string ImplicitStep::words_of_failure(const NewtonResult& newton) const {
  if (!newton.linear_failure.empty()) {
    return newton.linear_failure;
  }
  std::string words;
  switch (newton.ended) {
    case SNES_DIVERGED_LINE_SEARCH:
      words = "no part of Newton's step lowers the potential without turning elements over";
      break;
    case SNES_DIVERGED_FNORM_NAN:
    case SNES_DIVERGED_FUNCTION_DOMAIN:
      words = "the forces are not finite: an element has collapsed, or a chamber has no volume left";
      break;
    case SNES_DIVERGED_MAX_IT:
      words = fmt::format(
          "Newton's method did not converge in {} iterations (residual {:.2e} N): no equilibrium near, or the "
          "step is too long",
          newton.iterations, newton.residual);
      break;
    default:
      words = std::string("Newton's method did not converge (") + SNESConvergedReasons[newton.ended] + ")";
  }
  if (concave_iterations_ > 0) {
    words += "; the tangent is not positive definite: there is no stable equilibrium near, ";
    if (objective_.columns() > 0) {  // There is gas.
      words +=
          "as beyond the highest pressure that the balloon can hold (to go there prescribe its volume or its amount of "
          "gas, or give time.arc_length), ";
    }
    words += "or the step is too long";
  }
  return words;
}

void ImplicitStep::update_jacobian() {
  if (objective_.update_pattern()) {
    has_new_pattern_ = true;
    lag_.forget();
    if (patches_) {
      patches_->forget_pattern();
    }
    if (factor_) {
      factor_->forget_pattern();
    }
    positive_ = {};
    system_.forget_pattern();
  }
  const bool renews_patches = patches_ && !is_factorised_ && lag_.due(system_.solver());
  if (renews_patches || positive_ != nullptr) {
    objective_.update_tangent(system_, 1);
    if (renews_patches) {
      lag_.renewed();
      patches_->refresh(objective_.position());
    }
    if (positive_ != nullptr) {
      check(MatCopy(system_.sparse(), positive_, SAME_NONZERO_PATTERN));
    }
  }
  if (!renews_patches || fraction_ < 1) {
    objective_.update_tangent(system_, fraction_);
  }
  if (path_) {
    path_->update(along_->load_rate(), along_->force_scale() / along_->length_scale());
  }
}

/// A preconditioner from an assembled positive tangent is suitable for other tangents, too.
PetscBool ImplicitStep::reuses_preconditioner(const NewtonRequest& request) {
  if (options_.far != FarTangent::positive || options_.mat_type == TangentMatrix::shell || patches_ || is_direct_) {
    return request.reuses_preconditioner;
  }
  if (!lag_.due(system_.solver())) {
    return PETSC_TRUE;
  }
  lag_.renewed();
  return PETSC_FALSE;
}

/// The share of the positive tangent (StepObjective::update_tangent) at the start of an iteration: the last one's,
/// reduced if the objective fell as the tangent predicted, otherwise increased.
double ImplicitStep::next_share() {
  // The residual over forces below which Newton's method is quadratic: above, the exact tangent of a sheet is seldom
  // positive definite, or no better. With much contact a smaller share, in the wind a larger one saves a little.
  constexpr double error_near_end = 0.1;
  constexpr double worth_exact = 1e-2;  // With a coarser tolerance the method ends before the exact tangent pays.
  // Ratios of the objective's fall to the predicted one: below the first the step was too long, above the second the
  // next one may be longer.
  constexpr double poor_ratio = 0.25;
  constexpr double good_ratio = 0.9;
  if (options_.far == FarTangent::positive) {
    const bool may_be_exact = exact_serves_ && options_.snes_rtol < worth_exact;
    return may_be_exact && objective_.residual_norm() <= error_near_end * objective_.residual_scale(options_.snes_rtol)
               ? 0
               : 1;
  }
  if (fraction_ == 0 || !objective_.blends()) {
    return 0;
  }
  if (last_ratio_ < poor_ratio) {
    return std::min(fraction_ + share_step, 1.0);
  }
  return last_ratio_ > good_ratio ? std::max(fraction_ - 2 * share_step, 0.0) : fraction_;
}

void ImplicitStep::factorise() {
  if (!factor_) {
    factor_.emplace(objective_.tangent(), system_, options_.solver_prefix);
  }
  is_factorised_ = true;
  system_.use(factor_->solver());
}

/// Solves J y = r for Newton's step, with J or a positive definite tangent in its place.
LinearResult ImplicitStep::solve(Vec right_hand_side, Vec solution) {
  LinearResult result;
  const auto attempt = [&] {
    result.go_on(solve_or_factorise(right_hand_side, solution));
    if (result.solved == Solved::bad_preconditioner && options_.mat_type == TangentMatrix::shell) {
      result.solved = Solved::concave;  // Blocks on the diagonal of a tangent are positive definite if it is.
    }
  };
  attempt();
  if (result.solved == Solved::bad_preconditioner && positive_ == nullptr && !system_.solves_sparse_alone() &&
      options_.mat_type != TangentMatrix::shell) {
    // It was made from the tangent without the gas, which may be indefinite even if the whole is positive definite.
    check(MatDuplicate(system_.sparse(), MAT_SHARE_NONZERO_PATTERN, positive_.create()));
    system_.precondition_from(positive_);
    update_jacobian();
    attempt();
  }
  while (result.solved == Solved::concave && fraction_ < 1) {
    fraction_ = objective_.blends() && options_.far == FarTangent::exact ? std::min(fraction_ + share_step, 1.0) : 1;
    objective_.update_tangent(system_, fraction_);
    attempt();
  }
  if (fraction_ > 0 && options_.far == FarTangent::exact) {
    ++concave_iterations_;
  }
  return result;
}

/// Solves with the present tangent; if iterations fail, it is factorised from now on, if that is allowed.
LinearResult ImplicitStep::solve_or_factorise(Vec right_hand_side, Vec solution) {
  LinearResult result = solve_once(right_hand_side, solution);
  const bool has_failed = result.solved == Solved::no || result.solved == Solved::bad_preconditioner;
  if (has_failed && may_factorise_ && !is_factorised_) {
    has_failed_ = true;
    factorise();
    result.go_on(solve_once(right_hand_side, solution));
  }
  return result;
}

LinearResult ImplicitStep::solve_once(Vec right_hand_side, Vec solution) {
  if (is_factorised_) {
    check(KSPSetTolerances(factor_->solver(), linear_rtol_, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
    const std::optional<int> negative = factor_->refresh();
    if (!negative || *negative > 0) {
      LinearResult result;
      result.refuse(Solved::concave, "the tangent is not positive definite");
      return result;
    }
  }
  if (bordered_) {
    return bordered_->solve(right_hand_side, solution);
  }
  if (path_) {
    return path_->solve(right_hand_side, solution);
  }
  // The linear solver need not resolve forces that are rounding or negligible.
  const LinearNeed need{largest_unjudged_rtol, std::max(rounding_, objective_.rounding())};
  LinearResult result = system_.solve(right_hand_side, solution, &need);
  double curvature = 0;  // y.A y
  check(VecDot(right_hand_side, solution, &curvature));
  if (result.converged && curvature < 0) {
    result.refuse(Solved::concave, "the tangent is not positive definite");
  }
  return result;
}

/// Shortens Newton's step until no element turns over in it and the potential falls; with prescribed volumes the
/// potential includes the multipliers' terms for the volumes' errors. In a step in time an element may turn by any
/// angle, as in a fold of a slack wall, but in no iteration by more than a right angle.
std::optional<double> ImplicitStep::search(const NewtonStep& step) {
  objective_.move_to(step.position);
  if (before_) {
    before_->values() = objective_.position().values();
  }
  const auto move_by = [&](double fraction) {
    check(VecWAXPY(step.trial, -fraction, step.descent, step.position));
    objective_.move_to(step.trial);
  };
  const auto turns_over = [&] { return before_ && objective_.inverted(*before_, objective_.position()) > 0; };
  objective_.limit(step.residual, step.descent);
  if (path_) {
    const auto merit = [&](double fraction) {
      move_by(fraction);
      return turns_over() ? std::nullopt : std::optional(0.0);
    };
    return backtrack(merit, 0, 0, 0);
  }
  double weight = 0;  // of the volumes' errors: larger than any multiplier, so that they are an exact penalty
  double slope = 0;
  const auto volume_error = [this] { return objective_.volume_residual().cwiseAbs().sum(); };
  check(VecDot(step.residual, step.descent, &slope));
  const double promised = slope / 2;
  const double start = objective_.value();
  double before = start;
  if (bordered_) {
    const double error = volume_error();
    move_by(1);
    weight = 2 * objective_.multiplier().cwiseAbs().maxCoeff();
    before += weight * error;
    slope = 0;  // only a decrease is asked for
  } else if (options_.newton == NewtonEnd::converged) {
    // With a tangent that is not positive definite it may rise to the largest of so many of its last values, by at most
    // so many times the predicted fall.
    constexpr std::size_t most_last_values = 8;
    constexpr double most_rise = 16;
    last_values_.push_back(before);
    if (last_values_.size() > most_last_values) {
      last_values_.erase(last_values_.begin());
    }
    if (fraction_ > 0) {
      before = std::min(*std::max_element(last_values_.begin(), last_values_.end()), start + most_rise * promised);
    }
  }
  const double rounding = 1e-13 * (std::abs(before) + objective_.force_scale() * objective_.length_scale());
  double after = 0;
  const auto merit = [&](double fraction) -> std::optional<double> {
    move_by(fraction);
    if (turns_over()) {
      return std::nullopt;
    }
    after = objective_.value() + weight * volume_error();
    return after;
  };
  std::optional<double> length = backtrack(std::cref(merit), before, slope, rounding);
  if (!length && options_.far == FarTangent::positive && fraction_ < 1) {
    // The exact tangent may be indefinite, which some solvers do not detect.
    exact_serves_ = false;
    fraction_ = 1;
    objective_.move_to(step.position);
    objective_.update_tangent(system_, fraction_);
    if (solve_once(step.residual, step.descent).converged) {
      objective_.limit(step.residual, step.descent);
      length = backtrack(std::cref(merit), before, 0, rounding);
    }
  }
  last_ratio_ = length != 1 ? 0 : bordered_ ? 1 : (start - after) / promised;
  return length;
}

}  // namespace pellicle::equilibrium
