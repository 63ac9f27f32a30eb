#pragma once

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "parallel/joined_layout.h"
#include "solvers/low_rank_system.h"
#include "solvers/part_potential.h"
#include "solvers/step_part.h"
#include "solvers/tangent.h"

namespace pellicle {
inline namespace solvers {

/// What an implicit step makes stationary, its gradient and its second derivative: the sum of the parts of objects, and
/// of what is between them, such as contact.
///
/// The unknowns are the positions of the owned vertices of all parts, as in JoinedLayout, then on rank 0 the parts' own
/// unknowns.
class StepObjective {
 public:
  /// Collective. All must outlive it.
  /// @param parts at least one @param between potentials of the positions of all parts, as JoinedLayout has them
  /// @param type, prefix see Tangent
  StepObjective(const std::vector<StepPart*>& parts, std::vector<Potential*> between, const Choice<TangentMatrix>& type,
                const std::string& prefix);
  StepObjective(const StepObjective&) = delete;  // The tangent points to its layout.
  StepObjective& operator=(const StepObjective&) = delete;

  const Layout& vertices() const { return joined_.layout(); }
  const std::vector<std::array<PetscInt, 3>>& triangles() const {
    return parts_.size() == 1 ? parts_.front()->triangles() : triangles_;
  }

  /// To be called when all parts have begun a step of length h [s]. @returns whether all held vertices are where the
  /// step has to take them; if not, the step is too long. Collective.
  bool begin_step(double h);
  /// Collective.
  void move_to(Vec unknowns);
  void write_to(Vec unknowns) const;
  /// x, ghosts up to date.
  const Field& position() const { return position_; }

  /// The energy at x [J]. Collective.
  double value();
  /// Gradient at x, and the rows of the parts' own unknowns. Collective.
  void compute_residual(Vec residual);
  /// The force that the last residual is compared with [N]: the largest norm of a kind of force of the part that is
  /// furthest from balance, times the ratio by which less is asked of that part than `rtol` (StepPart::tolerance).
  /// Collective.
  double residual_scale(double rtol) const;
  /// Figures of the volumes that are prescribed, see StepPart. Not collective.
  Eigen::VectorXd excess_volume() const;
  Eigen::VectorXd multiplier() const;
  Eigen::VectorXd pressure_scales() const;
  std::vector<int> prescribed() const;
  /// The norm of the last residual of the positions [N]. Collective.
  double residual_norm() const;
  /// See StepPart. Not collective.
  bool inverts() const;
  /// See StepPart::inverted. Collective.
  double inverted(const Field& from, const Field& to) const;
  /// Changes the descent y of Newton's step from x to x - y, in all unknowns: leaves out what rounding has put into
  /// directions that are held, and shortens it, see limit_step. Collective.
  void limit(Vec residual, Vec descent) const;
  /// See Potential::renew, for all potentials. Collective.
  bool renew();
  /// See Tangent::move_on.
  bool move_on() { return tangent_->move_on(position_); }

  const Tangent& tangent() const { return *tangent_; }
  /// Columns of the low-rank part of the second derivative.
  int columns() const;
  /// Adds to columns of several parts what joins them, once all of them exist.
  /// @param first column of each part @param left share that is left out of what is not positive, 0 to 1
  using Joint = std::function<void(LowRank& all, const std::vector<Eigen::Index>& first, double left)>;
  void set_joint(Joint joint) { joint_ = std::move(joint); }
  /// Sets the second derivative at x. Collective.
  /// @param system of the tangent's matrix, with so many columns
  /// @param positive_share of the way from the exact tangent to the positive one (see `blends`)
  void update_tangent(Curvature curvature, LowRankSystem& system, double positive_share = 0);
  /// Whether the exact tangent can go over to the positive one step by step.
  bool blends() const;

  /// See StepPart. Not collective.
  bool suits_patches() const;
  /// The part that follows arc length; null: none does. Not collective.
  StepPart* path() const { return parts_.front()->follows_path() ? parts_.front() : nullptr; }

  /// The largest of the parts'.
  double length_scale() const;
  double force_scale() const;
  double rounding() const;

 private:
  MPI_Comm comm() const { return vertices().comm; }
  LowRank dense_tangent(double left);
  /// Where a part is if the whole is at x.
  const Field& place(std::size_t part, const Field& x, std::size_t which = 0) const;
  template <class Of>
  Eigen::VectorXd of_parts(const Of& of) const;

  std::vector<StepPart*> parts_;
  Joint joint_;
  JoinedLayout joined_;
  std::vector<std::array<PetscInt, 3>> triangles_;  ///< if there are several parts
  std::vector<std::unique_ptr<Potential>> adapted_;
  std::vector<Potential*> between_;
  std::vector<Potential*> potentials_;  ///< all of them, of the positions of all parts
  std::unique_ptr<Tangent> tangent_;
  int rank_ = 0;
  Field start_;  ///< if there is anything between the parts
  Field position_;
  mutable std::vector<std::array<Field, 2>> places_;  ///< of each of several parts, for a moment
  std::vector<double> squared_residuals_;             ///< of each part, this rank's share of the last residual [N^2]
  mutable std::vector<double> squares_;               ///< these and those of all forces, for a moment
  Eigen::Matrix3Xd of_between_;                       ///< the gradient of a potential between the parts
};

}  // namespace solvers
}  // namespace pellicle
