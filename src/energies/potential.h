#pragma once

#include <petscsys.h>

#include <Eigen/Core>
#include <vector>

#include "energies/hessian_terms.h"
#include "parallel/field.h"

namespace pellicle::energies {

/// Kinds of second derivative of a potential: both ends of a way of which some potentials can also go a part. For the
/// others every number but `psd` means `exact`.
struct Curvature {
  static constexpr double exact = 0;
  static constexpr double psd = 1;  ///< a projection of it that is positive semi-definite whatever the state
};

/// Way to shorten a step that is too long for some vertices.
enum class StepLimit {
  each_vertex,  ///< shortens the steps of these vertices alone
  all_alike     ///< shortens the steps of all vertices by the same fraction
};

/// Position of a block (3 x 3) in a Hessian.
struct VertexPair {
  PetscInt row = 0;     ///< local vertex; the rows of ghosts are passed over
  PetscInt column = 0;  ///< global vertex, of any rank
};

/// The pairs of each owned vertex with itself.
inline std::vector<VertexPair> diagonal_pairs(const Layout& vertices) {
  std::vector<VertexPair> pairs;
  for (PetscInt i = 0; i < vertices.owned; ++i) {
    pairs.push_back({i, vertices.to_global(i)});
  }
  return pairs;
}

/// Takes the blocks of a Hessian, one for each pair of its pattern.
class HessianBlocks {
 public:
  virtual ~HessianBlocks() = default;

  /// Takes a block. @param pair its number in the pattern @param block [N/m]
  virtual void add(std::size_t pair, const Eigen::Matrix3d& block) const = 0;
  /// Whether blocks of two different vertices are needed; if not, they may be left out.
  virtual bool wants_off_diagonal() const { return true; }
};

/// Passes the blocks of a Hessian to a function of their number in the pattern and a block.
template <class Take>
class TakenPairs : public HessianBlocks {
 public:
  explicit TakenPairs(const Take& take, bool wants_off_diagonal = true)
      : take_(take), wants_off_diagonal_(wants_off_diagonal) {}
  void add(std::size_t pair, const Eigen::Matrix3d& block) const override { take_(pair, block); }
  bool wants_off_diagonal() const override { return wants_off_diagonal_; }

 private:
  const Take& take_;
  bool wants_off_diagonal_;
};

/// A part of the energy that a step makes stationary, as a function of the positions x of a layout's vertices: the
/// interface of elastic walls, inertia, loads and contact for a tangent and Newton's method.
///
/// Positions are fields with ghosts up to date. Every rank has its fraction of a sum over all ranks, and the complete
/// values for the vertices that it owns. All functions may be collective, unless stated otherwise.
class Potential {
 public:
  virtual ~Potential() = default;

  /// This rank's fraction of the energy [J].
  virtual double value(const Field& x) const = 0;

  /// Adds the derivative by the owned vertices, minus the force, to (3 x owned) `gradient` [N].
  virtual void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const = 0;
  /// Adds the gradient. @returns the value
  virtual double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
    add_gradient(x, gradient);
    return value(x);
  }

  /// The blocks that the Hessian may have: with (i, j) also (j, i), on the ranks that own the rows. A pair may occur
  /// several times; its blocks are then added.
  virtual std::vector<VertexPair> pattern() const = 0;
  /// Grows whenever the pattern changes, by as much on every rank. Not collective.
  virtual PetscInt pattern_version() const { return 0; }

  /// Evaluates the Hessian at x, for add_hessian and products. @param psd_blend of the way from the exact Hessian to
  /// the positive one, 0 to 1
  virtual void update_hessian(const Field& x, double psd_blend) = 0;
  /// Adds the blocks of the last Hessian. Not collective.
  virtual void add_hessian(const HessianBlocks& blocks) const = 0;

  /// Called at the start of a step of length h [s] with the positions at which Newton's method is to begin; may change
  /// these, ghosts included. Collective.
  virtual void start_from(const Field& /*start*/, Field& /*x*/, double /*h*/) {}
  /// Called when Newton's method has ended. @returns whether the energy has changed on any rank, so that the method has
  /// to go on. Collective.
  virtual bool refresh(const Field& /*x*/) { return false; }
  /// Called at each iterate of Newton's method, before its pattern and Hessian are used. May change the pattern, but
  /// not the energy. Collective.
  virtual void update_pattern(const Field& /*x*/) {}
  /// Whether `limit` ever shortens a step. Not collective.
  virtual bool limits() const { return false; }
  /// Shortens a step of Newton's method from x, of the owned vertices (3 x owned) [m], to the range in which this
  /// energy is valid, as contact covers near surfaces only.
  /// @returns whether a step was shortened on any rank. Collective.
  virtual bool limit(const Field& /*x*/, StepLimit /*how*/, Eigen::Ref<Eigen::Matrix3Xd> /*step*/) { return false; }

  /// Whether a matrix-free tangent uses this potential's terms or `add_product` instead of its blocks. Not collective.
  virtual bool multiplies() const { return has_terms(); }
  /// Whether it gives its Hessian by `visit`, not by products; then it couples local vertices only. Not collective.
  virtual bool has_terms() const { return false; }
  /// Adds H w to `result`, both (3 x local); ghosts get only a part of their sum. Not collective.
  virtual void add_product(const double* /*w*/, double* /*result*/) const {}
  /// Passes the terms of the last Hessian on. Not collective.
  virtual void visit(HessianTerms& /*terms*/) const {}
};

}  // namespace pellicle::energies
