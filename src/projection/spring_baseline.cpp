#include "projection/spring_baseline.h"

#include <Eigen/Core>
#include <algorithm>
#include <tuple>
#include <utility>

#include "base/error.h"
#include "base/options.h"
#include "solvers/ksp.h"

namespace pellicle {
inline namespace projection {

namespace {

/// How often a Newton update is halved until the potential falls: if it still does not, that is rounding.
constexpr int most_halvings = 20;

/// Relative rounding of the potential, a sum of squares: a smaller rise does not count.
constexpr double rounding = 1e-13;

using Block = Eigen::Matrix<PetscScalar, 3, 3, Eigen::RowMajor>;

bool is_one_of(Mat matrix, MatType on_one_rank, MatType on_several) {
  PetscBool is = PETSC_FALSE;
  check(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(matrix), &is, on_one_rank, on_several, ""));
  return is == PETSC_TRUE;
}

}  // namespace

void describe(OptionTable& table, SpringOptions& options) {
  table.add("spring.stiffness", options.stiffness)
      .unit("N/m")
      .more_than(0)
      .help(
          "stiffness of every spring of the mass-spring sheet; the sheet's own does not depend on the cell size then. "
          "The default stretches a metre of 1 kg/m^2 by about 10 %, of office paper by 1 %, under its weight")
      .source("burning paper, section 8, Fig. 7 b, d");
  table.add("spring.damping", options.damping)
      .unit("s")
      .at_least(0)
      .help("damping coefficient of every spring over its stiffness");
  table.add("spring.newton_steps", options.newton_steps)
      .range(1, 100)
      .help("linear solves a time step, at most; one is the usual linearised backward Euler");
  table.add("spring.newton_tolerance", options.newton_tolerance)
      .range(1e-14, 0.1)
      .help("largest update at which Newton's method ends, as a share of the mean spring length");
  table.add_solver_prefix("spring_");
}

SpringBaseline::SpringBaseline(const Sheet& sheet, const SpringOptions& options)
    : sheet_(&sheet), options_(options), unconstrained_(sheet.particles, 3), before_update_(sheet.particles, 3) {
  const Layout& particles = sheet.particles;
  // Ghost springs too: they contribute to the rows of the particles at their ends here, so that no values need to be
  // sent.
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
  // Of these, what sbaij keeps.
  std::vector<PetscInt> own_upper = own_blocks;
  std::vector<PetscInt> other_upper = other_blocks;
  for (const auto& [row, column] : blocks) {
    const bool is_own = column < particles.owned;
    ++(is_own ? own_blocks : other_blocks)[static_cast<std::size_t>(row)];
    if (particles.to_global(column) > particles.to_global(row)) {
      ++(is_own ? own_upper : other_upper)[static_cast<std::size_t>(row)];
    }
  }
  check(MatCreate(particles.comm, tangent_.create()));
  check(MatSetSizes(tangent_, 3 * particles.owned, 3 * particles.owned, PETSC_DETERMINE, PETSC_DETERMINE));
  check(MatSetBlockSize(tangent_, 3));
  check(MatSetType(tangent_, MATBAIJ));
  check(MatSetOptionsPrefix(tangent_, options.solver_prefix.c_str()));
  run_solver(options.solver_prefix, [&] { check(MatSetFromOptions(tangent_)); });
  const bool is_upper = is_one_of(tangent_, MATSEQSBAIJ, MATMPISBAIJ);
  if (!is_upper && !is_one_of(tangent_, MATSEQBAIJ, MATMPIBAIJ) && !is_one_of(tangent_, MATSEQAIJ, MATMPIAIJ)) {
    MatType type = nullptr;
    check(MatGetType(tangent_, &type));
    throw Error("-" + options.solver_prefix + "mat_type: gives a matrix of type " + type +
                ", expected baij, aij or sbaij");
  }
  check(MatXAIJSetPreallocation(tangent_, 3, own_blocks.data(), other_blocks.data(), own_upper.data(),
                                other_upper.data()));
  check(MatSetOption(tangent_, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  if (is_upper) {
    check(MatSetOption(tangent_, MAT_IGNORE_LOWER_TRIANGULAR, PETSC_TRUE));
  }
  set_definite(tangent_);
  check(MatCreateVecs(tangent_, update_.create(), residual_.create()));

  KspDefaults defaults;
  defaults.preconditioner = PCPBJACOBI;
  defaults.rtol = 1e-6;
  defaults.fields = {"x", "y", "z"};
  defaults.largest_rtol = largest_unjudged_rtol;
  solver_ = make_ksp(tangent_, tangent_, options.solver_prefix, defaults);
}

void SpringBaseline::combine(const SpringInput& input) {
  // A spring and the dashpot beside it act as one spring.
  dashpot_ = options_.stiffness * options_.damping / input.h;
  combined_stiffness_ = options_.stiffness + dashpot_;
  std::array<double, 2> length_and_count{0, 0};
  for (std::size_t colour = 0; colour < sheet_->springs.size(); ++colour) {
    const SpringSet& set = sheet_->springs[colour];
    std::vector<double>& lengths = combined_length_[colour];
    lengths.resize(set.ends.size());
    for (std::size_t s = 0; s < lengths.size(); ++s) {
      const auto [a, b] = set.ends[s];
      const double start_length = (input.start.vector(a) - input.start.vector(b)).norm();
      lengths[s] =
          (options_.stiffness * input.target_length[colour][s] + dashpot_ * start_length) / combined_stiffness_;
      if (s < static_cast<std::size_t>(set.owned()) && input.living.springs[colour][s]) {
        length_and_count[0] += set.initial_length[s];
        length_and_count[1] += 1;
      }
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, length_and_count.data(), 2, MPI_DOUBLE, MPI_SUM, sheet_->comm());
  mean_length_ = length_and_count[0] / std::max(1.0, length_and_count[1]);
}

double SpringBaseline::potential(const Field& positions, const SpringInput& input) const {
  double sum = 0;
  for (PetscInt i = 0; i < sheet_->particles.owned; ++i) {
    const Eigen::Vector3d away = positions.vector(i) - unconstrained_.vector(i);
    sum += away.dot(input.inertia(i) * away);
  }
  for (std::size_t colour = 0; colour < sheet_->springs.size(); ++colour) {
    const SpringSet& set = sheet_->springs[colour];
    // Owned springs only: a ghost spring is counted by its owner.
    for (std::size_t s = 0; s < static_cast<std::size_t>(set.owned()); ++s) {
      if (!input.living.springs[colour][s]) {
        continue;
      }
      const auto [a, b] = set.ends[s];
      const double stretch = (positions.vector(a) - positions.vector(b)).norm() - combined_length_[colour][s];
      sum += combined_stiffness_ * stretch * stretch;
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, sheet_->comm());
  return sum / 2;
}

void SpringBaseline::assemble(const Field& positions, const SpringInput& input) {
  const Layout& particles = sheet_->particles;
  const auto add_block = [this, &particles](PetscInt row, PetscInt column, const Block& block) {
    const PetscInt global_row = particles.to_global(row);
    const PetscInt global_column = particles.to_global(column);
    check(MatSetValuesBlocked(tangent_, 1, &global_row, 1, &global_column, block.data(), ADD_VALUES));
  };
  const Block no_tangent = Block::Zero();
  check(MatZeroEntries(tangent_));
  PetscScalar* residual_values = nullptr;
  check(VecGetArrayWrite(residual_, &residual_values));
  Eigen::Map<Eigen::Matrix3Xd> residual(residual_values, 3, particles.owned);
  for (PetscInt i = 0; i < particles.owned; ++i) {
    const Eigen::Matrix3d inertia = input.inertia(i);
    residual.col(i) = -inertia * (positions.vector(i) - unconstrained_.vector(i));
    // A removed particle has neither inertia nor springs: any stiffness holds it.
    const bool is_removed = input.mass[static_cast<std::size_t>(i)] == 0;
    add_block(i, i, is_removed ? Block(combined_stiffness_ * Block::Identity()) : Block(inertia));
  }
  for (std::size_t colour = 0; colour < sheet_->springs.size(); ++colour) {
    const SpringSet& set = sheet_->springs[colour];
    for (std::size_t s = 0; s < set.ends.size(); ++s) {
      const auto [a, b] = set.ends[s];
      const Eigen::Vector3d arm = positions.vector(a) - positions.vector(b);
      const double d = input.living.springs[colour][s] ? arm.norm() : 0;
      // A spring that is dead or without a direction contributes nothing, but its blocks belong to the pattern.
      const Eigen::Vector3d n = d > 0 ? Eigen::Vector3d(arm / d) : Eigen::Vector3d(Eigen::Vector3d::Zero());
      const double across = d > 0 ? std::max(0.0, 1 - combined_length_[colour][s] / d) : 0;
      const Eigen::Vector3d force_on_a = -combined_stiffness_ * (d - combined_length_[colour][s]) * n;
      const Block tangent =
          combined_stiffness_ * ((1 - across) * n * n.transpose() + across * Eigen::Matrix3d::Identity());
      for (const auto& [row, column, sign] : {std::tuple{a, b, 1.0}, std::tuple{b, a, -1.0}}) {
        if (row >= particles.owned) {
          continue;
        }
        // A pinned particle keeps only the inertia in its row, and is taken out of the others' rows: its update is
        // zero.
        const bool row_pinned = input.pinned[static_cast<std::size_t>(row)];
        const bool column_pinned = input.pinned[static_cast<std::size_t>(column)];
        add_block(row, row, row_pinned ? no_tangent : tangent);
        add_block(row, column, row_pinned || column_pinned ? no_tangent : Block(-tangent));
        if (!row_pinned) {
          residual.col(row) += sign * force_on_a;
        }
      }
    }
  }
  check(VecRestoreArrayWrite(residual_, &residual_values));
  check(MatAssemblyBegin(tangent_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(tangent_, MAT_FINAL_ASSEMBLY));
}

std::array<std::vector<double>, 4> SpringBaseline::forces(const Field& positions, const Living& living) const {
  std::array<std::vector<double>, 4> result;
  for (std::size_t colour = 0; colour < sheet_->springs.size(); ++colour) {
    const SpringSet& set = sheet_->springs[colour];
    result[colour].resize(static_cast<std::size_t>(set.owned()));
    for (std::size_t s = 0; s < result[colour].size(); ++s) {
      if (living.springs[colour][s]) {
        const double length = (positions.vector(set.ends[s][0]) - positions.vector(set.ends[s][1])).norm();
        result[colour][s] = combined_stiffness_ * (length - combined_length_[colour][s]);
      }
    }
  }
  return result;
}

/// Over the owned living springs of all ranks. @param term of the colour, the spring and its ends
template <class Term>
double SpringBaseline::sum_over_springs(const Living& living, const Term& term) const {
  double sum = 0;
  for (std::size_t colour = 0; colour < sheet_->springs.size(); ++colour) {
    const SpringSet& set = sheet_->springs[colour];
    for (std::size_t s = 0; s < static_cast<std::size_t>(set.owned()); ++s) {
      sum += living.springs[colour][s] ? term(colour, s, set.ends[s]) : 0;
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, sheet_->comm());
  return sum;
}

double SpringBaseline::elastic_energy(const Field& positions, const std::array<std::vector<double>, 4>& target_length,
                                      const Living& living) const {
  return sum_over_springs(living, [&](std::size_t colour, std::size_t s, const std::array<PetscInt, 2>& ends) {
    const double stretch = (positions.vector(ends[0]) - positions.vector(ends[1])).norm() - target_length[colour][s];
    return options_.stiffness / 2 * stretch * stretch;
  });
}

double SpringBaseline::viscous_work(const Field& positions, const Field& start, const Living& living) const {
  return sum_over_springs(living, [&](std::size_t, std::size_t, const std::array<PetscInt, 2>& ends) {
    const double change = (positions.vector(ends[0]) - positions.vector(ends[1])).norm() -
                          (start.vector(ends[0]) - start.vector(ends[1])).norm();
    return -dashpot_ * change * change;
  });
}

StageResult SpringBaseline::advance(Field& positions, const SpringInput& input) {
  const PetscInt owned = sheet_->particles.owned;
  unconstrained_.values() = positions.values();
  combine(input);
  double lowest = potential(positions, input);
  StageResult result;
  for (int newton_step = 0; newton_step < options_.newton_steps; ++newton_step) {
    assemble(positions, input);
    // Forces that stretch one spring by no more than an update at which Newton's method ends need no answer.
    const LinearNeed need{largest_unjudged_rtol, combined_stiffness_ * options_.newton_tolerance * mean_length_};
    const StageResult solved = solve(solver_, residual_, update_, &need);
    result.iterations += solved.iterations;
    if (!solved.converged) {
      result.converged = false;
      result.reason = solved.reason;
      return result;
    }
    check(VecNorm(update_, NORM_INFINITY, &result.error));
    // An update this small cannot be judged by the potential: the change may be rounding.
    const bool last = result.error <= options_.newton_tolerance * mean_length_;
    PetscScalar* update_values = nullptr;
    check(VecGetArray(update_, &update_values));
    Eigen::Map<Eigen::Matrix3Xd> update(update_values, 3, owned);
    for (PetscInt i = 0; i < owned; ++i) {
      if (input.pinned[static_cast<std::size_t>(i)]) {
        update.col(i).setZero();  // Some solvers leave rounding here.
      }
    }
    before_update_.values() = positions.values();
    double share = 1;
    for (int trial = 0; trial < most_halvings; ++trial) {
      positions.values().leftCols(owned) = before_update_.values().leftCols(owned) + share * update;
      positions.update_ghosts();
      const double now = last ? lowest : potential(positions, input);
      if (now <= lowest * (1 + rounding)) {
        lowest = now;
        break;
      }
      share /= 2;
    }
    check(VecRestoreArray(update_, &update_values));
    if (last) {
      break;
    }
  }
  return result;
}

}  // namespace projection
}  // namespace pellicle
