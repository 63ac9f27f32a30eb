#include "projection/line_elimination.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/error.h"
#include "base/sorting.h"
#include "linear/ksp.h"
#include "linear/shell_operations.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"

namespace pellicle::projection {

namespace {

/// Without a shift a straight line between two pins is singular: a pivot below this fraction of the diagonal counts as
/// zero.
constexpr double negligible = 1e-12;

/// Lines whose lengths have about this ratio, or less, count as equally long.
constexpr double similar = 1.06;

/// Copies values by spring to `count` unknowns from `first` on; 0 for idle ones.
void gather(const JoinedLines& lines, std::size_t first, std::size_t count, const double* by_spring, double* values) {
  const PetscInt* springs = lines.springs().data() + first;
  for (std::size_t i = 0; i < count; ++i) {
    values[i] = springs[i] < 0 ? 0 : by_spring[springs[i]];
  }
}

void scatter(const JoinedLines& lines, std::size_t first, std::size_t count, const double* values, double* by_spring) {
  const PetscInt* springs = lines.springs().data() + first;
  for (std::size_t i = 0; i < count; ++i) {
    if (springs[i] >= 0) {
      by_spring[springs[i]] = values[i];
    }
  }
}

/// Entry of J W J^T of two springs with one common particle.
double entry_of(const SpringSet& set, const SpringPair& pair, const Eigen::Matrix3Xd& gradient,
                const std::vector<double>& inverse_mass) {
  const PetscInt joint = joint_of(set, pair.own, pair.other);
  const double product = inverse_mass[joint >> 1] * gradient.col(pair.own).dot(gradient.col(pair.other));
  return (joint & 1) == 0 ? product : -product;
}

}  // namespace

JoinedLines::JoinedLines(const SpringSet& set, LineFamily& family, bool keeps_entries)
    : ends_(family.lines.size()), spike_of_(family.lines.size()), set_(set), family_(family) {
  const std::vector<std::vector<PetscInt>>& lines = family.lines;
  std::vector<bool> has_spike(lines.size(), false);
  for (const LineEnd& end : family.ends) {
    has_spike[end.line] = has_spike[end.line] || end.end == 0;
  }
  auto order = numbers_up_to<std::size_t>(lines.size());
  // Lines of a group should also be neighbours, so that they read close memory.
  const auto key = [&](std::size_t line) {
    const double length = static_cast<double>(lines[line].size());
    return std::tuple(!has_spike[line], -std::lround(std::log(length) / std::log(similar)), lines[line].front());
  };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  for (std::size_t first = 0; first < lines.size(); first += lanes) {
    const std::size_t start = springs_.size();
    std::size_t longest = 0;
    for (std::size_t k = first; k < std::min(first + lanes, lines.size()); ++k) {
      longest = std::max(longest, lines[order[k]].size());
    }
    springs_.resize(start + lanes * longest, -1);
    joints_.resize(springs_.size(), -1);
    for (std::size_t lane = 0; lane < std::min(lanes, lines.size() - first); ++lane) {
      const std::vector<PetscInt>& line = lines[order[first + lane]];
      ends_[order[first + lane]] = {start + lane, start + lanes * (line.size() - 1) + lane};
      spike_of_[order[first + lane]] = first + lane;
      if (has_spike[order[first + lane]]) {
        spiked_firsts_.push_back(start + lane);
      }
      for (std::size_t k = 0; k < line.size(); ++k) {
        const std::size_t unknown = start + lanes * k + lane;
        springs_[unknown] = line[k];
        joints_[unknown] = k == 0 ? -1 : joint_of(set, line[k], line[k - 1]);
      }
    }
    groups_.push_back(springs_.size());
    spiked_groups_ += has_spike[order[first]] ? 1 : 0;
  }
  spikes_.resize(groups_[spiked_groups_]);
  if (keeps_entries) {
    diagonal_.resize(springs_.size());
    coupling_.assign(springs_.size() + lanes, 0);
  }
  inverse_pivot_.resize(springs_.size());
  factor_.assign(springs_.size() + lanes, 0);
  for (std::size_t line = 0; line < lines.size(); ++line) {
    if (unknowns_.size() < family.separators.size() && lines[line].front() == family.separators[unknowns_.size()]) {
      unknowns_.push_back(ends_[line][0]);
    }
  }
  family.lines = {};
  end_coupling_.resize(family_.ends.size());
  separators_.resize(2 * static_cast<std::size_t>(family_.separators_of_all));
  right_.resize(family_.separators_of_all);
  values_.resize(size());
}

void JoinedLines::factorise(const std::vector<double>& diagonal, const Eigen::Matrix3Xd& gradient,
                            const std::vector<double>& inverse_mass) {
  const double* gradients = gradient.data();
  using Columns = Eigen::Array<double, lanes, 3>;
  Columns before = Columns::Zero();  // gradients of the unknowns before
  Lanes inverse = Lanes::Zero();
  for (std::size_t i = 0; i < springs_.size(); i += lanes) {
    Columns own;
    Lanes entry;
    Lanes mass;  // inverse, with the sign of the entry
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const PetscInt spring = springs_[i + lane];
      const PetscInt joint = joints_[i + lane];
      const auto row = static_cast<Eigen::Index>(lane);
      mass[row] = joint < 0 ? 0 : (joint & 1) == 0 ? inverse_mass[joint >> 1] : -inverse_mass[joint >> 1];
      entry[row] = spring < 0 ? 1 : diagonal[spring];
      for (Eigen::Index k = 0; k < 3; ++k) {
        own(row, k) = spring < 0 ? 0 : gradients[3 * spring + k];
      }
    }
    const Lanes coupling = mass * (own * before).rowwise().sum();
    const Lanes factor = coupling * inverse;
    inverse = (entry - factor * coupling).max(negligible * entry).inverse();
    Eigen::Map<Lanes>(factor_.data() + i) = factor;
    Eigen::Map<Lanes>(inverse_pivot_.data() + i) = inverse;
    if (!diagonal_.empty()) {
      Eigen::Map<Lanes>(diagonal_.data() + i) = entry;
      Eigen::Map<Lanes>(coupling_.data() + i) = coupling;
    }
    before = own;
  }
  std::fill(spikes_.begin(), spikes_.end(), 0);
  for (const std::size_t first : spiked_firsts_) {
    spikes_[first] = 1;
  }
  for (std::size_t group = 0; group < spiked_groups_; ++group) {
    forward(group, spikes_.data() + groups_[group]);
  }
  check(PetscLogFlops(12.0 * static_cast<double>(springs_.size())));
}

void JoinedLines::forward(std::size_t group, double* values) const {
  const double* factor = factor_.data() + groups_[group];
  Lanes before = Lanes::Zero();
  for (const double* end = factor + group_size(group); factor != end; factor += lanes, values += lanes) {
    before = Eigen::Map<const Lanes>(values) - Eigen::Map<const Lanes>(factor) * before;
    Eigen::Map<Lanes>{values} = before;
  }
}

void JoinedLines::backward(std::size_t group, double* values) const {
  const std::size_t start = groups_[group];
  const double* factor = factor_.data() + start;
  const double* inverse_pivot = inverse_pivot_.data() + start;
  Lanes after = Lanes::Zero();
  for (std::size_t i = group_size(group); i >= lanes; i -= lanes) {
    after = Eigen::Map<const Lanes>(values + i - lanes) * Eigen::Map<const Lanes>(inverse_pivot + i - lanes) -
            Eigen::Map<const Lanes>(factor + i) * after;
    Eigen::Map<Lanes>{values + i - lanes} = after;
  }
}

void JoinedLines::multiply(const double* in, double* out) const {
  Lanes before = Lanes::Zero();
  for (std::size_t i = 0; i < springs_.size(); i += lanes) {
    const Lanes own = Eigen::Map<const Lanes>(in + i);
    Lanes sum =
        Eigen::Map<const Lanes>(diagonal_.data() + i) * own + Eigen::Map<const Lanes>(coupling_.data() + i) * before;
    if (i + lanes < springs_.size()) {
      sum += Eigen::Map<const Lanes>(coupling_.data() + i + lanes) * Eigen::Map<const Lanes>(in + i + lanes);
    }
    Eigen::Map<Lanes>(out + i) = sum;
    before = own;
  }
  check(PetscLogFlops(5.0 * static_cast<double>(springs_.size())));
}

void JoinedLines::first_values(std::size_t group, const double* values, double* by_spike) const {
  if (group < spiked_groups_) {
    Eigen::Map<Lanes> sum(by_spike + lanes * group);
    for (std::size_t i = groups_[group]; i < groups_[group + 1]; i += lanes, values += lanes) {
      sum += Eigen::Map<const Lanes>(spikes_.data() + i) * Eigen::Map<const Lanes>(inverse_pivot_.data() + i) *
             Eigen::Map<const Lanes>(values);
    }
  }
}

void JoinedLines::subtract_spikes(std::size_t group, const double* by_spike, double* values) const {
  if (group < spiked_groups_) {
    const Eigen::Map<const Lanes> factor(by_spike + lanes * group);
    for (std::size_t i = groups_[group]; i < groups_[group + 1]; i += lanes, values += lanes) {
      Eigen::Map<Lanes> value(values);
      value -= factor * Eigen::Map<const Lanes>(spikes_.data() + i);
    }
  }
}

void JoinedLines::update(const std::vector<double>& diagonal, const Eigen::Matrix3Xd& gradient,
                         const std::vector<double>& inverse_mass) {
  factorise(diagonal, gradient, inverse_mass);
  if (!is_joined()) {
    return;
  }
  by_spike_.assign(lanes * spiked_groups_, 0);
  for (std::size_t group = 0; group < groups(); ++group) {
    first_values(group, spikes_.data() + groups_[group], by_spike_.data());
  }
  const std::size_t count = right_.size();
  std::fill(separators_.begin(), separators_.end(), 0);
  for (std::size_t k = 0; k < unknowns_.size(); ++k) {
    separators_[family_.numbers[k]] += diagonal[family_.separators[k]];
  }
  for (std::size_t k = 0; k < family_.neighbours.size(); ++k) {
    separators_[count + 1 + static_cast<std::size_t>(family_.neighbour_numbers[k])] +=
        entry_of(set_, family_.neighbours[k], gradient, inverse_mass);
  }
  for (std::size_t k = 0; k < end_coupling_.size(); ++k) {
    const LineEnd& end = family_.ends[k];
    end_coupling_[k] = entry_of(set_, end.pair, gradient, inverse_mass);
    const std::size_t last = ends_[end.line][1];
    separators_[end.number] -=
        end_coupling_[k] * end_coupling_[k] * (end.end == 0 ? by_spike_[spike_of_[end.line]] : inverse_pivot_[last]);
    if (k > 0 && family_.ends[k - 1].line == end.line) {
      const std::size_t number = std::max(end.number, family_.ends[k - 1].number);
      separators_[count + number] -= end_coupling_[k] * end_coupling_[k - 1] * spikes_[last] * inverse_pivot_[last];
    }
  }
  for (const std::size_t unknown : unknowns_) {
    inverse_pivot_[unknown] = 1;
  }
  sum_over_ranks(set_.layout.comm, separators_);
  double inverse = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double entry = separators_[k];
    double& coupling = separators_[count + k];
    const double factor = coupling * inverse;
    inverse = 1 / std::max(entry - factor * coupling, negligible * entry);
    separators_[k] = inverse;
    coupling = factor;
  }
}

void JoinedLines::solve(const double* in, double* out) {
  solve_in(
      out, true, [&](std::size_t first, std::size_t count, double* values) { std::copy_n(in + first, count, values); },
      [](std::size_t, std::size_t, const double*) {});
}

void JoinedLines::solve_separators(double* values) {
  std::fill(right_.begin(), right_.end(), 0);
  for (std::size_t k = 0; k < unknowns_.size(); ++k) {
    right_[family_.numbers[k]] = values[unknowns_[k]];
  }
  for (std::size_t k = 0; k < end_coupling_.size(); ++k) {
    const LineEnd& end = family_.ends[k];
    const std::size_t last = ends_[end.line][1];
    right_[end.number] -=
        end_coupling_[k] * (end.end == 0 ? by_spike_[spike_of_[end.line]] : values[last] * inverse_pivot_[last]);
  }
  sum_over_ranks(set_.layout.comm, right_);
  const double* inverse_pivot = separators_.data();
  const double* factor = separators_.data() + right_.size();
  for (std::size_t k = 1; k < right_.size(); ++k) {
    right_[k] -= factor[k] * right_[k - 1];
  }
  for (std::size_t k = right_.size(); k-- > 0;) {
    right_[k] = right_[k] * inverse_pivot[k] - (k + 1 < right_.size() ? factor[k + 1] * right_[k + 1] : 0);
  }
  for (std::size_t k = 0; k < end_coupling_.size(); ++k) {
    const LineEnd& end = family_.ends[k];
    const double product = end_coupling_[k] * right_[end.number];
    if (end.end == 0) {
      by_spike_[spike_of_[end.line]] = product;
    } else {
      values[ends_[end.line][1]] -= product;
    }
  }
  for (std::size_t k = 0; k < unknowns_.size(); ++k) {
    values[unknowns_[k]] = right_[family_.numbers[k]];
  }
}

LineElimination::LineElimination(const SpringSet& springs, const Layout& particles, const std::string& prefix)
    : lines_(find_lines(springs, particles)),
      eliminated_(springs, lines_.eliminated, false),
      kept_(springs, lines_.kept, true) {
  MPI_Comm comm = springs.layout.comm;
  const PetscInt unknowns = kept_.size();
  const PetscInt first = number_owned(comm, unknowns).first;
  // Global unknown of S of each local spring, or -1.
  std::vector<PetscInt> columns(springs.ends.size(), -1);
  std::vector<PetscInt> previous(springs.ends.size(), -1);  // in the line of a kept spring
  for (PetscInt i = 0; i < unknowns; ++i) {
    const PetscInt spring = kept_.springs()[i];
    if (spring >= 0) {
      columns[spring] = first + i;
      previous[spring] = kept_.previous(i);
    }
  }
  update_ghosts(springs.layout, columns);
  const auto is_in_lines = [&previous](PetscInt row, PetscInt column) {
    return row == column || previous[row] == column || previous[column] == row;
  };
  std::vector<PetscInt> rows = eliminated_.springs();
  const Incidence incidence(springs.ends, particles.local());
  for (PetscInt i = 0; i < unknowns; ++i) {
    const PetscInt spring = kept_.springs()[i];
    const auto has_entries = [&](PetscInt particle) {
      const Incidence::Range all = incidence[particle];
      return std::any_of(all.begin(), all.end(),
                         [&](PetscInt other) { return columns[other] >= 0 && !is_in_lines(spring, other); });
    };
    if (spring >= 0 && std::any_of(springs.ends[spring].begin(), springs.ends[spring].end(), has_entries)) {
      off_lines_.push_back(static_cast<std::size_t>(i));
      rows.push_back(spring);
    }
  }
  coupling_ = std::make_unique<GramBlock>(springs, particles, rows, columns, unknowns, is_in_lines);
  rows_ = std::make_unique<GramRows>(coupling_->matrix());
  off_line_values_.resize(off_lines_.size());
  check(MatCreateVecs(coupling_->matrix(), kept_values_.create(), nullptr));
  check(VecDuplicate(kept_values_, kept_right_hand_side_.create()));

  schur_ = symmetric_shell<&LineElimination::multiply>(comm, unknowns, this);
  set_definite(schur_);
  set_matrix_options(schur_, prefix);
  preconditioner_ = {
      {}, [this](Vec in, Vec out) { kept_.solve(ConstVecValues(in).data(), VecValues(out).data()); }, words()};
  offer_preconditioner(schur_, type, preconditioner_);
}

std::string LineElimination::words() const {
  const auto count = [](const JoinedLines& lines) {
    return std::to_string(
        std::count_if(lines.springs().begin(), lines.springs().end(), [](PetscInt spring) { return spring >= 0; }));
  };
  return "tridiagonal solves along lines of springs, on this rank " + count(eliminated_) + " springs eliminated, " +
         count(kept_) + " kept";
}

void LineElimination::update(const std::vector<double>& diagonal, const Eigen::Matrix3Xd& gradient,
                             const std::vector<double>& inverse_mass) {
  eliminated_.update(diagonal, gradient, inverse_mass);
  kept_.update(diagonal, gradient, inverse_mass);
  coupling_->update(gradient, inverse_mass, diagonal);
  check(MatAssemblyBegin(schur_, MAT_FINAL_ASSEMBLY));  // Tells PETSc that values have changed.
  check(MatAssemblyEnd(schur_, MAT_FINAL_ASSEMBLY));
}

void LineElimination::multiply(Vec in_vector, Vec out_vector) {
  const ConstVecValues in(in_vector);
  VecValues out(out_vector);
  rows_->begin(in.data());
  kept_.multiply(in.data(), out.data());
  rows_->end(in.data());
  eliminated_.solve_by_groups(
      [&](std::size_t first, std::size_t count, double* values) { rows_->multiply(first, count, in.data(), values); },
      [&](std::size_t first, std::size_t count, const double* x) {
        rows_->subtract_transposed(first, count, x, out.data());
      });
  const std::size_t below = eliminated_.size();
  rows_->multiply(below, off_lines_.size(), in.data(), off_line_values_.data());
  for (std::size_t k = 0; k < off_lines_.size(); ++k) {
    out[off_lines_[k]] += off_line_values_[k];
  }
  rows_->send(out.data());
}

/// Computes the right-hand side of S.
void LineElimination::eliminate(Vec right_hand_side) {
  const ConstVecValues all(right_hand_side);
  VecValues kept(kept_right_hand_side_);
  gather(kept_, 0, kept_.springs().size(), all.data(), kept.data());
  eliminated_.solve_by_groups([&](std::size_t first, std::size_t count,
                                  double* values) { gather(eliminated_, first, count, all.data(), values); },
                              [&](std::size_t first, std::size_t count, const double* x) {
                                rows_->subtract_transposed(first, count, x, kept.data());
                              });
  rows_->send(kept.data());
}

/// Computes the eliminated values from the kept ones, and combines both in lambda.
void LineElimination::substitute(Vec right_hand_side, Vec lambda) {
  const ConstVecValues kept(kept_values_);
  const ConstVecValues given(right_hand_side);
  VecValues all(lambda);
  rows_->begin(kept.data());
  scatter(kept_, 0, kept_.springs().size(), kept.data(), all.data());
  rows_->end(kept.data());
  const PetscInt* springs = eliminated_.springs().data();
  eliminated_.solve_by_groups(
      [&](std::size_t first, std::size_t count, double* values) {
        rows_->multiply(first, count, kept.data(), values);
        for (std::size_t i = 0; i < count; ++i) {
          const PetscInt spring = springs[first + i];
          values[i] = (spring < 0 ? 0 : given[spring]) - values[i];
        }
      },
      [&](std::size_t first, std::size_t count, const double* x) {
        scatter(eliminated_, first, count, x, all.data());
      });
}

StageResult LineElimination::solve(KSP ksp, Vec right_hand_side, Vec lambda, const LinearNeed* need) {
  eliminate(right_hand_side);
  StageResult result = pellicle::solve(ksp, kept_right_hand_side_, kept_values_, need);
  substitute(right_hand_side, lambda);
  return result;
}

void LineElimination::apply(Vec in, Vec out) {
  eliminate(in);
  kept_.solve(ConstVecValues(kept_right_hand_side_).data(), VecValues(kept_values_).data());
  substitute(in, out);
}

}  // namespace pellicle::projection
