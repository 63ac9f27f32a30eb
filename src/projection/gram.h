#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/handle.h"
#include "parallel/field.h"
#include "projection/gram_block.h"
#include "projection/line_elimination.h"
#include "projection/project_options.h"
#include "surface/sheet.h"

namespace pellicle::projection {

/// The constraints of one colour at some positions (burning paper, eq. 10 and 11).
struct Linearisation {
  Eigen::VectorXd error;      ///< C = d^2/l - l of the local springs [m]
  Eigen::Matrix3Xd gradient;  ///< 2 (x_a - x_b)/l of the local springs, by x_a; minus that by x_b, (3 x local)
};

/// Evaluates C and its gradient; both are 0 for a dead spring.
/// @param x positions of the local particles [m], ghosts up to date
/// @param target target length l > 0 of the local springs [m]
/// @param active whether each local spring lives, ghosts up to date
void linearise(const SpringSet& springs, const double* x, const std::vector<double>& target,
               const std::vector<bool>& active, Linearisation& result);

/// J W J^T of one colour (eq. 16): W holds the inverse masses of the particles. Rows are the springs.
///
/// The pattern is made once, from the topology; `update` fills in values, without communication other than a maximum.
class Gram {
 public:
  /// The matrix offers the preconditioner `lines` (LineElimination). Collective.
  /// @param mat_type aij, sell or shell @param prefix of the options of its matrices
  Gram(const SpringSet& springs, const Layout& particles, Choice<GramFormat> mat_type, const std::string& prefix = "");
  Gram(const Gram&) = delete;
  Gram& operator=(const Gram&) = delete;

  /// Sets new values: J W J^T + shift times the largest diagonal entry. A spring that is dead, without length or
  /// without a movable particle has an empty row, with that largest entry on the diagonal, so that its multiplier is 0.
  /// Collective.
  /// @param shift_inverse_mass if given, the shift is relative to the largest entry of a spring between two particles
  /// of this inverse mass, so that one light particle does not soften all springs
  /// @param gradient of the local springs, must stay unchanged while a shell is used
  /// @param inverse_mass of the local particles
  void update(const Eigen::Matrix3Xd& gradient, const std::vector<double>& inverse_mass, double shift,
              std::optional<double> shift_inverse_mass = std::nullopt);

  /// J^T lambda, similar to a force, on the local particles; complete on the owned ones. Collective.
  /// @param lambda of the owned springs
  /// @param result (3 x local)
  void apply_transpose(const Eigen::Matrix3Xd& gradient, Vec lambda, Eigen::Matrix3Xd& result);

  /// Diagonal of the owned springs, with the shift.
  const std::vector<double>& diagonal() const { return diagonal_; }

  Mat operator_matrix() const { return mat_type_ == GramFormat::aij ? rows_->matrix() : Mat(other_); }
  Mat preconditioning_matrix() const { return mat_type_ == GramFormat::shell ? Mat(other_) : rows_->matrix(); }

 private:
  void multiply(Vec in, Vec out);
  void copy_diagonal(Vec out) const;

  const SpringSet& springs_;
  const Layout& particles_;
  GramFormat mat_type_;
  std::unique_ptr<GramBlock> rows_;         ///< all rows, assembled
  MatHandle other_;                         ///< sell or shell
  std::unique_ptr<LineElimination> lines_;  ///< made when the preconditioner is requested
  OwnPreconditioner preconditioner_;
  std::vector<double> diagonal_;  ///< of J W J^T, then with the shift
  const Eigen::Matrix3Xd* gradient_ = nullptr;
  const std::vector<double>* inverse_mass_ = nullptr;
  Field lambda_;                   ///< on the local springs
  Eigen::Matrix3Xd particle_sum_;  ///< scratch of the shell's product
};

}  // namespace pellicle::projection
