#include "projection/successive_projection.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "base/incidence.h"
#include "base/units.h"
#include "linear/shell_operations.h"
#include "parallel/collective.h"
#include "surface/weave_strain.h"

namespace pellicle::projection {

namespace {

// Inverse masses are relative to the mean one; at the edge of a sheet corners have half of the others' mass.
constexpr double inverse_mass_at_edges = 2;

// Correction of springs that are beyond the strain limit:
constexpr double aim = 0.8;           ///< fraction of the limit to which springs are corrected
constexpr double limit_shift = 1e-5;  ///< shift of these systems, unless the options' shift is smaller

/// Excess of a constraint error beyond that of a strain. @param target l [m]
double excess(double error, double target, double strain) {
  const auto at = [&](double ratio) { return target * (ratio * ratio - 1); };
  return error - std::clamp(error, at(1 - std::min(strain, 1.0)), at(1 + strain));
}

}  // namespace

void require_shift_at_irregular_vertices(const Sheet& sheet, const ProjectOptions& options) {
  constexpr int most_neighbours = 6;     // Burning paper, section 8.2.
  constexpr double least_shift = 0.001;  // Measured with 12 neighbours: steps fail at 1e-4, none at 1e-3.
  if (options.shift >= least_shift) {
    return;
  }
  std::array<PetscInt, 2> worst{};  // minus the number of neighbours, then the id
  for (const Colour colour : all_colours) {
    if (sheet.acts(colour)) {
      const Incidence incidence(sheet.of(colour).ends, sheet.particles.local());
      for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
        worst = std::min(worst, {-static_cast<PetscInt>(incidence[i].size()), sheet.persistent_id[i]});
      }
    }
  }
  const std::vector<std::array<PetscInt, 2>> of_ranks = of_all_ranks(sheet.comm(), std::vector{worst});
  const auto [count, vertex] = *std::min_element(of_ranks.begin(), of_ranks.end());
  if (-count <= most_neighbours) {
    return;
  }
  throw Error("project.shift: " + number_text(options.shift) + ", expected at least " + number_text(least_shift) +
              " as vertex " + std::to_string(vertex) + " has " + std::to_string(-count) +
              " neighbours by springs of one colour: beyond six the projection diverges without it");
}

ProjectionError constraint_errors(const Sheet& sheet, const Field& x,
                                  const std::array<std::vector<double>, 4>& target_length, const ActiveSet& active) {
  ProjectionError error;
  for (const Colour colour : all_colours) {
    const SpringSet& springs = sheet.of(colour);
    double sum = 0;
    for (PetscInt s = 0; s < springs.owned() && sheet.acts(colour); ++s) {
      if (active.springs[colour][s]) {
        const auto& [a, b] = springs.ends[s];
        const double target = target_length[colour][s];
        const double constraint = (x.vector(a) - x.vector(b)).squaredNorm() / target - target;
        sum += constraint * constraint;
      }
    }
    error.colour[colour] = sum;
  }
  error.colour = sum_over_ranks(sheet.comm(), error.colour);
  error.total = std::sqrt(std::accumulate(error.colour.begin(), error.colour.end(), 0.0));
  for (double& value : error.colour) {
    value = std::sqrt(value);
  }
  return error;
}

void to_forces(std::array<std::vector<double>, 4>& pull, const Sheet& sheet, const ProjectionInput& input, double h) {
  const auto inverse_mass = [&input](PetscInt particle) {
    return input.pinned[particle] ? 0 : 1 / input.mass[particle];
  };
  for (std::size_t colour = 0; colour < pull.size(); ++colour) {
    for (std::size_t s = 0; s < pull[colour].size(); ++s) {
      const auto [a, b] = sheet.springs[colour].ends[s];
      const double inverse_masses = input.active.springs[colour][s] ? inverse_mass(a) + inverse_mass(b) : 0;
      pull[colour][s] = inverse_masses > 0 ? pull[colour][s] / (h * h * inverse_masses) : 0;
    }
  }
}

SuccessiveProjection::SuccessiveProjection(const Sheet& sheet, const ProjectOptions& options,
                                           std::array<std::vector<double>, 4> spring_weight)
    : sheet_(sheet), options_(options) {
  require_shift_at_irregular_vertices(sheet, options);
  for (const Colour colour : colours_of(options.order)) {
    if (sheet.acts(colour)) {
      colours_.push_back(colour);
    }
  }
  for (const Colour colour : colours_) {
    const SpringSet& springs = sheet.of(colour);
    System& system = systems_[colour];
    // Another preconditioner from the options needs the entries of the Gram matrix.
    const std::string prefix = options.solver_prefix + colour_names[colour] + "_";
    GramFormat format = options.mat_type;
    const bool eliminates_lines =
        format == GramFormat::lines &&
        option_value("-" + prefix + "pc_type").value_or(LineElimination::type) == LineElimination::type;
    if (format == GramFormat::lines) {
      format = eliminates_lines ? GramFormat::shell : GramFormat::aij;
    }
    system.gram = std::make_unique<Gram>(springs, sheet.particles, format, prefix);
    KspDefaults defaults{KSPCG, PCBJACOBI, options_.ksp_rtol, 10000};
    defaults.fields = {"lambda"};
    defaults.largest_rtol = largest_unjudged_rtol;
    if (eliminates_lines) {
      system.lines = std::make_unique<LineElimination>(springs, sheet.particles, prefix);
      defaults.preconditioner = LineElimination::type;
      Mat schur_complement = system.lines->schur_complement();
      system.ksp = make_ksp(schur_complement, schur_complement, prefix, defaults);
    } else {
      system.ksp = make_ksp(system.gram->operator_matrix(), system.gram->preconditioning_matrix(), prefix, defaults);
    }
    check(
        MatCreateVecs(system.gram->preconditioning_matrix(), system.lambda.create(), system.right_hand_side.create()));
    system.weight.assign(springs.owned(), options.weight[colour]);
    if (!spring_weight[colour].empty()) {
      std::transform(system.weight.begin(), system.weight.end(), spring_weight[colour].begin(), system.weight.begin(),
                     std::multiplies<>());
    }
  }
  if (options.method == ProjectMethod::joint) {
    joint_ = std::make_unique<JointGram>(sheet, colours_, options.solver_prefix + "joint_", options.ksp_rtol);
  }
}

void SuccessiveProjection::begin(const ProjectionInput& input) {
  if (joint_ != nullptr) {
    joint_->begin_step();
  }
  if (input.pull != nullptr) {
    for (std::size_t colour = 0; colour < 4; ++colour) {
      (*input.pull)[colour].assign(static_cast<std::size_t>(sheet_.springs[colour].owned()), 0);
    }
  }
  const std::size_t count = input.mass.size();
  gram_inverse_mass_.assign(count, 1);
  if (options_.masses == GramMasses::actual) {
    // Scaled by the mean mass of the remaining particles, so that the numbers stay near one.
    const auto end = input.mass.begin() + sheet_.particles.owned;
    std::array<double, 2> sums{std::accumulate(input.mass.begin(), end, 0.0),
                               static_cast<double>(sheet_.particles.owned - std::count(input.mass.begin(), end, 0.0))};
    sums = sum_over_ranks(sheet_.comm(), sums);
    const double mean = sums[0] / sums[1];
    std::transform(input.mass.begin(), input.mass.end(), gram_inverse_mass_.begin(),
                   [mean](double mass) { return mass > 0 ? mean / mass : 0; });
  }
  move_inverse_mass_ = gram_inverse_mass_;
  for (std::size_t i = 0; i < count; ++i) {
    const bool has_left = input.mass[i] == 0;
    if (input.pinned[i] || has_left) {
      move_inverse_mass_[i] = 0;
      if (has_left || options_.pins == GramPins::exact) {
        gram_inverse_mass_[i] = 0;
      }
    }
  }
}

/// ||l^init|| of the active springs [m]. Collective.
double SuccessiveProjection::length_norm(const ActiveSet& active) const {
  double sum = 0;
  for (const Colour colour : colours_) {
    const SpringSet& springs = sheet_.of(colour);
    for (PetscInt s = 0; s < springs.owned(); ++s) {
      if (active.springs[colour][s]) {
        sum += springs.initial_length[s] * springs.initial_length[s];
      }
    }
  }
  return std::sqrt(sum_over_ranks(sheet_.comm(), sum));
}

StageResult SuccessiveProjection::project(Field& x, Colour colour, const ProjectionInput& input) {
  begin(input);
  return project_colour(x, colour, input);
}

StageResult SuccessiveProjection::project_colour(Field& x, Colour colour, const ProjectionInput& input,
                                                 std::optional<double> limit) {
  const SpringSet& springs = sheet_.of(colour);
  System& system = systems_[colour];
  Linearisation& constraint = system.linearisation;
  linearise(springs, x.data(), input.target_length[colour], input.active.springs[colour], constraint);
  const double shift = limit ? std::min(options_.shift, limit_shift) : options_.shift;
  system.gram->update(constraint.gradient, gram_inverse_mass_, shift,
                      options_.masses == GramMasses::actual ? std::optional(inverse_mass_at_edges) : std::nullopt);
  if (system.lines != nullptr) {
    system.lines->update(system.gram->diagonal(), constraint.gradient, gram_inverse_mass_);
  }
  {
    VecValues values(system.right_hand_side);
    for (PetscInt s = 0; s < springs.owned(); ++s) {
      const double error = constraint.error[s];
      values[s] = limit ? excess(error, input.target_length[colour][s], sheet_.layers == 1 ? 0 : aim * *limit)
                        : system.weight[s] * error;
    }
  }
  const LinearNeed need = this->need();
  StageResult result = system.lines != nullptr
                           ? system.lines->solve(system.ksp, system.right_hand_side, system.lambda, &need)
                           : solve(system.ksp, system.right_hand_side, system.lambda, &need);
  if (!result.converged) {
    return result;
  }
  system.gram->apply_transpose(constraint.gradient, system.lambda, displacement_);
  move(x);
  add_pull(input, colour, ConstVecValues(system.lambda).data());
  return result;
}

/// Moves the particles by `displacement_` times their inverse masses. Collective.
void SuccessiveProjection::move(Field& x) {
  for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
    x.vector(i) -= move_inverse_mass_[i] * displacement_.col(i);
  }
  x.update_ghosts();
}

/// Projects all colours in one solve. Collective.
StageResult SuccessiveProjection::project_jointly(Field& x, const ProjectionInput& input) {
  std::array<const Eigen::Matrix3Xd*, 4> gradients{};
  joint_error_.clear();
  for (const Colour colour : colours_) {
    System& system = systems_[colour];
    linearise(sheet_.of(colour), x.data(), input.target_length[colour], input.active.springs[colour],
              system.linearisation);
    gradients[colour] = &system.linearisation.gradient;
    for (PetscInt s = 0; s < sheet_.of(colour).owned(); ++s) {
      joint_error_.push_back(system.weight[s] * system.linearisation.error[s]);
    }
  }
  joint_->update(gradients, gram_inverse_mass_, options_.shift,
                 options_.masses == GramMasses::actual ? inverse_mass_at_edges : 1);
  const StageResult result = joint_->solve(joint_error_, need());
  if (!result.converged) {
    return result;
  }
  joint_->apply_transpose(displacement_);
  move(x);
  for (const Colour colour : colours_) {
    add_pull(input, colour, joint_->lambda(colour));
  }
  return result;
}

void SuccessiveProjection::add_pull(const ProjectionInput& input, Colour colour, const double* lambda) const {
  const SpringSet& springs = sheet_.of(colour);
  const Eigen::Matrix3Xd& gradient = systems_[colour].linearisation.gradient;
  for (PetscInt s = 0; input.pull != nullptr && s < springs.owned(); ++s) {
    const auto& [a, b] = springs.ends[s];
    (*input.pull)[colour][s] += (move_inverse_mass_[a] + move_inverse_mass_[b]) * gradient.col(s).norm() * lambda[s];
  }
}

StageResult SuccessiveProjection::limit_strain(Field& x, const ProjectionInput& input) {
  StageResult result;
  const double limit = *options_.strain_limit;
  const auto strain_at_x = [&] { return weave_strain(sheet_, x, input.target_length, input.active); };
  WeaveStrain strain = strain_at_x();
  for (int step = 0;; ++step) {
    if (strain.largest <= limit) {
      if (!input.at_end || !input.at_end(x)) {
        return result;
      }
      strain = strain_at_x();
      if (strain.largest <= limit) {
        return result;
      }
    }
    if (step >= options_.strain_steps) {
      break;
    }
    for (const Colour colour : weave_colours) {
      if (sheet_.acts(colour) && !result.add(project_colour(x, colour, input, limit))) {
        return result;
      }
    }
    if (input.after_step) {
      input.after_step(x);
    }
    strain = strain_at_x();
  }
  result.converged = false;
  result.reason =
      beyond_limit(strain, limit) + ", after " + std::to_string(options_.strain_steps) + " steps to bring it back";
  return result;
}

StageResult SuccessiveProjection::advance(Field& x, const ProjectionInput& input) {
  StageResult result;
  begin(input);
  const double initial_length = length_norm(input.active);
  monitored_.clear();
  const auto after_step = [&] {
    if (input.after_step) {
      input.after_step(x);
    }
    result.error = errors(x, input).total;
  };
  const auto monitor = [&](int step, std::optional<Colour> projected) {
    if (options_.monitor) {
      monitored_.push_back(errors(x, input));
      monitored_.back().step = step;
      monitored_.back().projected = projected;
    }
  };
  monitor(0, std::nullopt);
  if (options_.threshold > 0) {
    result.error = errors(x, input).total;
  }
  if (result.error < options_.threshold) {
    after_step();  // A sheet that keeps its lengths may still have run into a body.
  }
  // Negated, so that an error that is not a number fails, too.
  for (int step = 1; step <= options_.max_steps && !(result.error < options_.threshold); ++step) {
    if (joint_ != nullptr) {
      if (!result.add(project_jointly(x, input))) {
        return result;
      }
      monitor(step, std::nullopt);
    } else {
      for (const Colour colour : colours_) {
        if (!result.add(project_colour(x, colour, input))) {
          return result;
        }
        monitor(step, colour);
      }
    }
    after_step();
    if (!(result.error <= options_.error_limit * initial_length)) {  // also when it is not a number
      result.converged = false;
      result.reason = "the projection diverged: ||C|| / ||l|| = " + std::to_string(result.error / initial_length) +
                      " after projection step " + std::to_string(step) + ", above project.error_limit " +
                      std::to_string(options_.error_limit);
      return result;
    }
  }
  if (options_.strain_limit) {
    result.add(limit_strain(x, input));
    result.error = errors(x, input).total;
  } else if (input.at_end) {
    input.at_end(x);
  }
  return result;
}

}  // namespace pellicle::projection
