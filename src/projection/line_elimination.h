#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/handle.h"
#include "base/stage_result.h"
#include "linear/ksp.h"
#include "linear/own_preconditioner.h"
#include "projection/gram_block.h"
#include "surface/sheet.h"

namespace pellicle::projection {

/// J W J^T along the lines of one family: a tridiagonal matrix for each line, factorised as L D L^T.
///
/// Several lines are processed side by side: unknown `k * lanes + lane` is spring k of a line. Lines of similar length
/// are grouped; shorter ones are padded with idle unknowns, which have a one on the diagonal.
///
/// Lines are joined by separators where ranks cut them: each rank solves forwards along its lines, all ranks solve the
/// tridiagonal systems of the separators, and each rank solves backwards. A separator before a line's first spring
/// changes L^-1 b by a multiple of the line's spike L^-1 e, with e the first unit vector. Lines with spikes come first.
class JoinedLines {
 public:
  /// Takes the lines from the family; it and the set must outlive this object. Collective.
  /// @param keeps_entries whether `multiply` is used
  JoinedLines(const SpringSet& set, LineFamily& family, bool keeps_entries);

  /// Spring of each unknown; -1: idle.
  const std::vector<PetscInt>& springs() const { return springs_; }
  PetscInt size() const { return static_cast<PetscInt>(springs_.size()); }
  /// Spring before an unknown's in its line, or -1.
  PetscInt previous(PetscInt unknown) const {
    const std::size_t i = unknown;
    return joints_[i] < 0 ? -1 : springs_[i - lanes];
  }

  /// Sets new values and factorises them. Collective. @param diagonal of the owned springs
  void update(const std::vector<double>& diagonal, const Eigen::Matrix3Xd& gradient,
              const std::vector<double>& inverse_mass);
  /// out = A in, for each line by itself.
  void multiply(const double* in, double* out) const;
  /// out = A^-1 in. Collective.
  void solve(const double* in, double* out);
  /// Solves A x = b by groups of lines, which stay in the cache. Collective.
  /// @param set function of a first unknown, a number of unknowns and their values, which it sets to b
  /// @param use function of the same arguments; the values are x
  template <class Set, class Use>
  void solve_by_groups(const Set& set, const Use& use) {
    solve_in(values_.data(), is_joined(), set, use);
  }

 private:
  static constexpr std::size_t lanes = 8;
  using Lanes = Eigen::Array<double, lanes, 1>;

  /// Sets new values of the lines and factorises each by itself.
  void factorise(const std::vector<double>& diagonal, const Eigen::Matrix3Xd& gradient,
                 const std::vector<double>& inverse_mass);

  // A^-1 b = L^-T D^-1 (L^-1 b) of the lines of one group; its values are in the order of the unknowns.
  std::size_t groups() const { return groups_.size() - 1; }
  std::size_t group_size(std::size_t group) const { return groups_[group + 1] - groups_[group]; }
  /// L^-1 b, in place.
  void forward(std::size_t group, double* values) const;
  /// A^-1 b from L^-1 b, in place.
  void backward(std::size_t group, double* values) const;
  /// Adds A^-1 b at the first springs of a group's lines with spikes. @param values L^-1 b
  void first_values(std::size_t group, const double* values, double* by_spike) const;
  /// values -= spikes times factors
  void subtract_spikes(std::size_t group, const double* by_spike, double* values) const;

  /// Whether any rank has separators.
  bool is_joined() const { return !right_.empty(); }
  /// @param values of one group, or of all if `for_all`, as joined lines need
  template <class Set, class Use>
  void solve_in(double* values, bool for_all, const Set& set, const Use& use) {
    const auto use_group = [&](std::size_t group, double* of_group) {
      backward(group, of_group);
      use(groups_[group], group_size(group), of_group);
    };
    by_spike_.assign(lanes * spiked_groups_, 0);
    for (std::size_t group = 0; group < groups(); ++group) {
      double* of_group = for_all ? values + groups_[group] : values;
      set(groups_[group], group_size(group), of_group);
      forward(group, of_group);
      if (is_joined()) {
        first_values(group, of_group, by_spike_.data());
      } else {
        use_group(group, of_group);
      }
    }
    if (is_joined()) {
      solve_separators(values);
      for (std::size_t group = 0; group < groups(); ++group) {
        double* of_group = values + groups_[group];
        subtract_spikes(group, by_spike_.data(), of_group);
        use_group(group, of_group);
      }
    }
    check(PetscLogFlops((is_joined() ? 10.0 : 5.0) * static_cast<double>(size())));
  }
  /// Solves for the separators of all ranks and subtracts their effect on the other springs from `values`; for lines
  /// with spikes sets the factors in `by_spike_` instead. Collective.
  /// @param values L^-1 b; at this rank's separators b on entry and x on return
  void solve_separators(double* values);

  std::vector<PetscInt> springs_;
  std::vector<PetscInt> joints_;  ///< signed particle that joins an unknown to the one before, as in GramBlock, or -1
  std::vector<std::array<std::size_t, 2>> ends_;  ///< first and last unknown of each line
  std::vector<std::size_t> spike_of_;             ///< place in arrays `by_spike` of each line, if it has a spike
  std::vector<std::size_t> groups_{0};            ///< (groups + 1), first unknown of each
  std::size_t spiked_groups_ = 0;                 ///< number of groups with spikes; they come first
  std::vector<std::size_t> spiked_firsts_;        ///< first unknowns of the lines with spikes
  std::vector<double> spikes_;                    ///< zeros for lines without spikes in the same groups
  std::vector<double> diagonal_;                  ///< if entries are kept
  std::vector<double> inverse_pivot_;             ///< 1 of a separator, for which `backward` is the identity
  // With an additional row of zeros, so that loops need not check for the end of a line.
  std::vector<double> coupling_;  ///< with the unknown before, if entries are kept
  std::vector<double> factor_;    ///< of L: coupling by the pivot before

  const SpringSet& set_;
  const LineFamily& family_;           ///< without the lines
  std::vector<std::size_t> unknowns_;  ///< this rank's separators
  std::vector<double> end_coupling_;   ///< of each end of a line with its separator
  std::vector<double> separators_;     ///< of all ranks: diagonal, then entry with the separator before
  std::vector<double> right_;          ///< of all separators
  std::vector<double> values_;         ///< L^-1 b, of all lines if they are joined, else of one group at the beginning
  std::vector<double> by_spike_;       ///< first values of lines, then factors of their spikes
};

/// Solves (J W J^T + shift) lambda = b of one colour by eliminating one family of lines exactly:
///
///     [A B] [x]   [a]        S y = b - B^T A^-1 a,  S = K - B^T A^-1 B
///     [B^T K] [y] = [b]      x = A^-1 (a - B y)
///
/// with A the eliminated lines (tridiagonal) and K the kept springs, whose lines precondition S: S offers them as the
/// preconditioner `lines`. PETSc solves with S, or with the whole matrix and `apply` as preconditioner.
class LineElimination {
 public:
  /// PETSc's name for the preconditioner.
  static constexpr const char* type = "lines";

  /// Collective. @param prefix of the options of S
  LineElimination(const SpringSet& springs, const Layout& particles, const std::string& prefix = "");
  LineElimination(const LineElimination&) = delete;
  LineElimination& operator=(const LineElimination&) = delete;

  /// Sets new values. Collective. @param diagonal of J W J^T + shift, of the owned springs
  void update(const std::vector<double>& diagonal, const Eigen::Matrix3Xd& gradient,
              const std::vector<double>& inverse_mass);

  /// S, matrix-free.
  Mat schur_complement() const { return schur_; }

  /// Collective.
  /// @param ksp solver for S
  /// @param right_hand_side,lambda of the owned springs @param need as for pellicle::solve
  StageResult solve(KSP ksp, Vec right_hand_side, Vec lambda, const LinearNeed* need = nullptr);

  /// out = P^-1 in for the owned springs, where P is the whole matrix with K's lines in place of S, symmetric positive
  /// definite. Collective.
  void apply(Vec in, Vec out);

  /// Message with the numbers of eliminated and kept springs on this rank, for a view.
  std::string words() const;

 private:
  void eliminate(Vec right_hand_side);
  void substitute(Vec right_hand_side, Vec lambda);
  void multiply(Vec in, Vec out);

  SpringLines lines_;
  JoinedLines eliminated_;
  JoinedLines kept_;
  std::unique_ptr<GramBlock> coupling_;  ///< B, and in further rows the entries of K that are not along lines
  std::unique_ptr<GramRows> rows_;       ///< of `coupling_`
  std::vector<std::size_t> off_lines_;   ///< unknowns of S in the rows below B
  std::vector<double> off_line_values_;  ///< values of these unknowns
  OwnPreconditioner preconditioner_;     ///< of S
  MatHandle schur_;
  VecHandle kept_right_hand_side_;
  VecHandle kept_values_;
};

}  // namespace pellicle::projection
