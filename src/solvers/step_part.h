#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "geometry/projectors.h"
#include "parallel/field.h"
#include "solvers/low_rank.h"
#include "solvers/potential.h"

namespace pellicle {
inline namespace solvers {

/// An object's part of what a step makes stationary (StepObjective): potentials of the positions x of its vertices, and
/// what has a dense second derivative, a sum of columns, such as the work of enclosed gas. All functions may be
/// collective, unless stated otherwise.
class StepPart {
 public:
  virtual ~StepPart() = default;

  virtual const Layout& vertices() const = 0;
  /// Local vertices of each triangle: they join the vertices.
  virtual const std::vector<std::array<PetscInt, 3>>& triangles() const = 0;
  /// Projectors on the directions in which each local vertex may move.
  virtual const Projectors& projectors() const = 0;
  virtual const std::vector<Potential*>& potentials() const = 0;

  /// Where the step starts, ghosts up to date.
  virtual const Field& start() const = 0;
  /// x: at the beginning of a step the place where Newton's method begins; ghosts up to date.
  virtual const Field& position() const = 0;
  /// Goes to other positions, ghosts up to date, and other unknowns of its own.
  virtual void move_to(const Field& position, const Eigen::VectorXd& own) = 0;
  /// Called when a potential has changed: its value at x is no longer known.
  virtual void forget() {}
  /// Unknowns in addition to the positions, each divided by its scale, the same on all ranks: pressures of prescribed
  /// volumes, or the loads' time. Not collective.
  virtual Eigen::VectorXd own_unknowns() const { return {}; }
  /// Whether held vertices are not where the step has to take them, on any rank.
  virtual bool leaves_held_behind() = 0;

  /// Energy at x, the sum over all ranks [J].
  virtual double value() = 0;
  /// Gradient by the owned vertices, in the directions in which they may move, (3 x owned) [N].
  virtual const Eigen::Matrix3Xd& gradient() = 0;
  /// This rank's squares of the norms of the kinds of force in the last gradient [N^2]. Not collective.
  virtual const std::vector<double>& squared_forces() const = 0;
  /// Residuals of its own unknowns, where the gradient was last asked for; the same on all ranks.
  virtual Eigen::VectorXd own_rows() { return {}; }
  /// Whether elements can turn over. Not collective.
  virtual bool inverts() const { return false; }
  /// Number of elements that turn over on the way from one place to another, on all ranks; ghosts up to date.
  virtual double inverted(const Field& /*from*/, const Field& /*to*/) const { return 0; }

  /// Number of columns of the dense second derivative. Not collective.
  virtual int columns() const { return 0; }
  /// To be called before the second derivatives of the potentials at x are asked for.
  /// @param positive_share of the way from the exact one to the positive one, see Potential::set_positive_share
  virtual void begin_tangent(Curvature curvature, double positive_share) = 0;
  /// The dense one then, by the owned vertices; of parts that have columns.
  virtual LowRank dense_tangent() { return {}; }
  /// Whether the exact tangent can go over to the positive one step by step. Not collective.
  virtual bool blends() const { return false; }

  /// Columns of volumes that are prescribed, whose pressures are unknowns: a BorderedSystem. Not collective.
  virtual std::vector<int> prescribed() const { return {}; }
  /// For the volumes that are prescribed: scales of the pressures among the unknowns [Pa], the pressures themselves
  /// [Pa], and by how much the volumes are too large where value or gradient were last asked for [m^3]. Not collective.
  virtual Eigen::VectorXd pressure_scales() const { return {}; }
  virtual Eigen::VectorXd multiplier() const { return {}; }
  virtual Eigen::VectorXd excess_volume() const { return {}; }

  /// Whether the step follows arc length: the time of its loads is its only unknown beside the positions, and its last
  /// column is that of the row which this adds (LoadBorder). Such a part is the only one. Not collective.
  virtual bool follows_path() const { return false; }
  /// Of a step that does: the derivative of the gradient by the loads' time, of the owned vertices [N/s], and the unit
  /// of the row of the residual [N/m].
  virtual Eigen::VectorXd load_rate() { return {}; }
  virtual double path_scale() const { return 1; }

  /// Norm of the gradient at which it is in balance, over the largest norm of a kind of force. Not collective.
  virtual double tolerance() const = 0;
  /// Its size [m], and the scale of its forces [N]. Not collective.
  virtual double length_scale() const = 0;
  virtual double force_scale() const = 0;
  /// Whether its stiffness is so many times its inertia that rigid patches (RigidPatches) pay. Not collective.
  virtual bool suits_patches() const { return true; }
  /// Rounding that may remain in the last gradient beyond what follows from the scale of forces [N]. Not collective.
  virtual double rounding() const { return 0; }
};

}  // namespace solvers
}  // namespace pellicle
