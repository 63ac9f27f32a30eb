#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "parallel/field.h"
#include "solvers/low_rank.h"
#include "solvers/potential.h"

namespace pellicle {
inline namespace solvers {

/// An object's part of what a step makes stationary (StepObjective): potentials of the positions x of its vertices, and
/// what has a dense second derivative, a sum of columns, such as the work of enclosed gas. All functions may be
/// collective, as far as nothing else is said.
class StepPart {
 public:
  virtual ~StepPart() = default;

  virtual const Layout& vertices() const = 0;
  /// Local vertices of each: what joins them.
  virtual const std::vector<std::array<PetscInt, 3>>& triangles() const = 0;
  /// On the directions in which each local vertex may move.
  virtual const std::vector<Eigen::Matrix3d>& projectors() const = 0;
  virtual const std::vector<Potential*>& potentials() const = 0;

  /// Where the step starts, ghosts up to date.
  virtual const Field& start() const = 0;
  /// x: in a step that begins where Newton's method begins; ghosts up to date.
  virtual const Field& position() const = 0;
  /// Goes to other positions, ghosts up to date, and other unknowns of its own.
  virtual void move_to(const Field& position, const Eigen::VectorXd& own) = 0;
  /// Told that a potential has become another one: what is known of its value at x is no longer so.
  virtual void forget() {}
  /// Unknowns beside the positions, each over its scale, the same on all ranks: pressures of prescribed volumes, or the
  /// loads' time. Not collective.
  virtual Eigen::VectorXd own_unknowns() const { return {}; }
  /// Whether vertices that are held are not where the step has to take them, on any rank.
  virtual bool leaves_held_behind() = 0;

  /// At x, of all ranks [J].
  virtual double value() = 0;
  /// By the owned vertices, where they may move, (3 x owned) [N].
  virtual Eigen::Matrix3Xd gradient() = 0;
  /// This rank's squares of the norms of the kinds of force in the last gradient [N^2]. Not collective.
  virtual const std::vector<double>& squared_forces() const = 0;
  /// Rows of the unknowns of its own, where the gradient was last asked for; the same on all ranks.
  virtual Eigen::VectorXd own_rows() { return {}; }
  /// Elements that turn over on the way from one place to another, on all ranks; ghosts up to date.
  virtual double inverted(const Field& /*from*/, const Field& /*to*/) const { return 0; }

  /// Of the dense second derivative. Not collective.
  virtual int columns() const { return 0; }
  /// Before the second derivatives of the potentials at x are asked for. @returns the dense one, by the owned vertices
  /// @param positive_share of the way from the exact one to the positive one, see Potential::set_positive_share
  virtual LowRank begin_tangent(Curvature curvature, double positive_share) = 0;
  /// Whether the exact tangent can go over to the positive one step by step. Not collective.
  virtual bool blends() const { return false; }

  /// Columns of volumes that are prescribed, whose pressures are unknowns: a BorderedSystem. Not collective.
  virtual std::vector<int> prescribed() const { return {}; }
  /// Of their pressures, in the unknowns [Pa], the pressures themselves [Pa], and by how much volumes are too large
  /// where value or gradient were last asked for [m^3]. Not collective.
  virtual Eigen::VectorXd pressure_scales() const { return {}; }
  virtual Eigen::VectorXd multiplier() const { return {}; }
  virtual Eigen::VectorXd excess_volume() const { return {}; }

  /// Norm of the gradient at which it is in balance, over the largest norm of a kind of force. Not collective.
  virtual double tolerance() const = 0;
  /// Its size [m], and what its forces are like [N]. Not collective.
  virtual double length_scale() const = 0;
  virtual double force_scale() const = 0;
  /// What rounding may leave of the last gradient beside what follows from the scale of forces [N]. Not collective.
  virtual double rounding() const { return 0; }
};

}  // namespace solvers
}  // namespace pellicle
