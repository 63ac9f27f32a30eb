#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "energies/potential.h"
#include "geometry/projectors.h"
#include "linear/low_rank.h"
#include "parallel/field.h"

namespace pellicle::energies {

/// An object's part of the energy that a step makes stationary (StepObjective): potentials of the positions x of its
/// vertices, and terms with a dense second derivative of low rank, such as the work of enclosed gas. All functions may
/// be collective, unless stated otherwise.
class StepPart {
 public:
  virtual ~StepPart() = default;

  const Layout& vertices() const { return vertices_; }
  /// Local vertices of each triangle, whose edges join vertices.
  const std::vector<std::array<PetscInt, 3>>& triangles() const { return triangles_; }
  const std::vector<Potential*>& potentials() const { return potentials_; }
  /// Projectors on the directions in which each local vertex may move.
  virtual const Projectors& projectors() const = 0;

  /// Positions at the step's start, ghosts up to date.
  virtual const Field& start() const = 0;
  /// Positions x, at the beginning of a step the first iterate of Newton's method; ghosts up to date.
  virtual const Field& position() const = 0;
  /// Sets positions, ghosts up to date, and the part's own unknowns. @returns whether the positions are others, on any
  /// rank
  virtual bool move_to(const Field& position, const Eigen::VectorXd& own) = 0;
  /// Discards stored values at x, when a potential has changed.
  virtual void forget() {}
  /// Unknowns in addition to the positions, each divided by its scale, the same on all ranks: pressures of prescribed
  /// volumes, or the loads' time. Not collective.
  virtual Eigen::VectorXd own_unknowns() const { return {}; }
  /// Whether any constrained vertex, on any rank, is not at its prescribed place.
  virtual bool leaves_held_behind() = 0;

  /// Energy at x, the sum over all ranks [J].
  virtual double value() = 0;
  /// Gradient by the owned vertices, in the directions in which they may move, (3 x owned) [N].
  virtual const Eigen::Matrix3Xd& gradient() = 0;
  /// This rank's squares of the norms of the kinds of force in the last gradient [N^2]. Not collective.
  virtual const std::vector<double>& squared_forces() const = 0;
  /// Residuals of the part's own unknowns, at the position of the last gradient; the same on all ranks.
  virtual Eigen::VectorXd own_rows() const { return {}; }
  /// Whether elements can turn over. Not collective.
  virtual bool inverts() const { return false; }
  /// Number of elements that turn over on the way from one place to another, on all ranks; ghosts up to date.
  virtual double inverted(const Field& /*from*/, const Field& /*to*/) const { return 0; }

  /// Number of columns of the dense second derivative. Not collective.
  virtual int columns() const { return 0; }
  /// Called before the second derivatives of the potentials at x are evaluated.
  /// @param psd_blend of the way from the exact tangent, 0, to the positive one, 1 (Potential::update_hessian); more
  /// than 0 and less than 1 only if the part `blends`
  virtual void begin_tangent(double /*psd_blend*/) {}
  /// Dense second derivative by the owned vertices, after begin_tangent; empty of parts without columns.
  virtual LowRank dense_tangent() { return {}; }
  /// Whether the exact tangent can be moved towards the positive one by a fraction. Not collective.
  virtual bool blends() const { return false; }

  /// Columns of prescribed volumes, whose pressures are unknowns (BorderedSystem). Not collective.
  virtual std::vector<int> prescribed() const { return {}; }
  /// For prescribed volumes: scales of the pressures among the unknowns [Pa], the pressures [Pa], and the excess of the
  /// volumes at the last evaluation of value or gradient [m^3]. Not collective.
  virtual Eigen::VectorXd pressure_scales() const { return {}; }
  virtual Eigen::VectorXd multiplier() const { return {}; }
  virtual Eigen::VectorXd volume_residual() const { return {}; }

  /// Whether the step follows arc length: the time of its loads is its only unknown beside the positions, and its last
  /// column is that of the row which this adds (LoadBorder). Such a part is the only one. Not collective.
  virtual bool follows_path() const { return false; }
  /// For such a step: the derivative of the gradient of the owned vertices by the loads' time [N/s].
  virtual Eigen::VectorXd load_rate() { return {}; }

  /// Norm of the gradient at which the part is in balance, over the largest norm of a kind of force. Not collective.
  double tolerance() const { return tolerance_; }
  /// Size of the part [m], and scale of its forces [N]. Not collective.
  double length_scale() const { return length_scale_; }
  double force_scale() const { return force_scale_; }
  /// Scale of its stiffness where it is [N/m]. Collective.
  virtual double stiffness_scale() { return force_scale() / length_scale(); }
  /// Whether the stiffness exceeds the inertia by so much that RigidPatches save time. Not collective.
  virtual bool suits_patches() const { return true; }
  /// Rounding in the last gradient, beyond that of the force scale [N]. Not collective.
  virtual double rounding() const { return 0; }

 protected:
  /// @param vertices, triangles of the part, which must outlive it
  StepPart(const Layout& vertices, const std::vector<std::array<PetscInt, 3>>& triangles, double tolerance)
      : vertices_(vertices), triangles_(triangles), tolerance_(tolerance) {}

  // The members below do not change after construction.
  const Layout& vertices_;
  const std::vector<std::array<PetscInt, 3>>& triangles_;
  double tolerance_;
  std::vector<Potential*> potentials_;
  double length_scale_ = 0;  ///< [m]
  double force_scale_ = 0;   ///< [N]
};

/// A StepPart whose energy is a sum of potentials. At one position they are evaluated once.
class PartOfPotentials : public StepPart {
 public:
  PartOfPotentials(const PartOfPotentials&) = delete;  // Its potentials point to it.
  PartOfPotentials& operator=(const PartOfPotentials&) = delete;

  const Field& position() const override { return position_; }
  bool move_to(const Field& position, const Eigen::VectorXd& own) override;
  void forget() override { is_evaluated_ = false; }
  double value() override;
  const Eigen::Matrix3Xd& gradient() override {
    evaluate();
    return gradient_;
  }
  const std::vector<double>& squared_forces() const override { return squares_; }

 protected:
  /// Arguments are those of StepPart.
  PartOfPotentials(const Layout& vertices, const std::vector<std::array<PetscInt, 3>>& triangles, double tolerance)
      : StepPart(vertices, triangles, tolerance), position_(vertices, 3) {}

  PetscInt owned() const { return vertices_.owned; }
  MPI_Comm comm() const { return vertices_.comm; }

  Field position_;

 private:
  void evaluate();

  // At `position_`, of this rank.
  bool is_evaluated_ = false;
  double value_ = 0;               ///< fraction of the energy [J]
  Eigen::Matrix3Xd gradient_;      ///< by the owned vertices, in the directions in which they may move [N]
  Eigen::Matrix3Xd of_potential_;  ///< the gradient of one potential, kept so that a step allocates nothing [N]
  std::vector<double> squares_;    ///< square of the norm of each potential's gradient [N^2]
};

/// Another part of a step, which a derived class adds something to.
class ExtendedPart : public StepPart {
 public:
  const Projectors& projectors() const override { return part_.projectors(); }
  const Field& start() const override { return part_.start(); }
  const Field& position() const override { return part_.position(); }
  void forget() override { part_.forget(); }
  bool leaves_held_behind() override { return part_.leaves_held_behind(); }
  double value() override { return part_.value(); }
  const Eigen::Matrix3Xd& gradient() override { return part_.gradient(); }
  const std::vector<double>& squared_forces() const override { return part_.squared_forces(); }
  bool inverts() const override { return part_.inverts(); }
  double inverted(const Field& from, const Field& to) const override { return part_.inverted(from, to); }
  void begin_tangent(double psd_blend) override { part_.begin_tangent(psd_blend); }
  bool blends() const override { return part_.blends(); }
  double stiffness_scale() override { return part_.stiffness_scale(); }
  bool suits_patches() const override { return part_.suits_patches(); }
  double rounding() const override { return part_.rounding(); }

 protected:
  /// @param part must outlive it
  explicit ExtendedPart(StepPart& part) : StepPart(part), part_(part) {}

  StepPart& part_;
};

}  // namespace pellicle::energies
