#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "energies/step_part.h"
#include "energies/tangent.h"
#include "linear/low_rank_system.h"
#include "parallel/joined_layout.h"

namespace pellicle::energies {

/// A potential of the vertices of one part of a JoinedLayout, as a potential of the whole.
class PartPotential : public Potential {
 public:
  /// All arguments must outlive it. Collective. @param vertices of the part
  PartPotential(Potential& potential, const JoinedLayout& joined, std::size_t part, const Layout& vertices);

  double value(const Field& x) const override { return potential_.value(taken(x)); }
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  PetscInt pattern_version() const override { return potential_.pattern_version(); }
  void update_hessian(const Field& x, double psd_blend) override { potential_.update_hessian(taken(x), psd_blend); }
  void add_hessian(const HessianBlocks& blocks) const override { potential_.add_hessian(blocks); }
  bool refresh(const Field& x) override { return potential_.refresh(taken(x)); }
  void update_pattern(const Field& x) override { potential_.update_pattern(taken(x)); }
  bool limits() const override { return potential_.limits(); }
  bool limit(const Field& x, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) override;
  bool multiplies() const override { return potential_.multiplies() && !potential_.has_terms(); }
  void add_product(const double* w, double* result) const override;

 private:
  const Field& taken(const Field& x) const {
    joined_.take(part_, x, place_);
    return place_;
  }

  Potential& potential_;
  const JoinedLayout& joined_;
  std::size_t part_;
  const Layout& vertices_;
  mutable Field place_;            ///< positions x of the part
  mutable Eigen::Matrix3Xd own_;   ///< of the part's vertices: a gradient, or the argument of a product
  mutable Eigen::Matrix3Xd more_;  ///< of the part's vertices: a product
};

/// Energy that an implicit step makes stationary, with gradient and second derivative: the sum of the parts of objects
/// and of a potential between them, their contact.
///
/// Unknowns are the positions of the owned vertices of all parts, as in JoinedLayout, then on rank 0 the parts' own
/// unknowns.
class StepObjective {
 public:
  /// Collective. All arguments must outlive this object.
  /// @param parts at least one @param between a potential of the positions of all parts, in the order of JoinedLayout;
  /// null: none
  /// @param type, prefix as for Tangent
  StepObjective(const std::vector<StepPart*>& parts, Potential* between, const Choice<TangentMatrix>& type,
                const std::string& prefix);
  StepObjective(const StepObjective&) = delete;  // The tangent points to its layout.
  StepObjective& operator=(const StepObjective&) = delete;

  const Layout& vertices() const { return joined_.layout(); }
  /// StepPart::triangles of all parts, with the local vertices of the whole.
  std::vector<std::array<PetscInt, 3>> triangles() const;

  /// Begins a step of length h [s], after all parts. @returns whether all constrained vertices are at their prescribed
  /// places; if not, the step is too long. Collective.
  bool begin_step(double h);
  /// Sets positions and own unknowns of all parts. Collective.
  void move_to(Vec unknowns);
  void write_to(Vec unknowns) const;
  /// Positions x, ghosts up to date.
  const Field& position() const { return position_; }

  /// The energy at x [J]. Collective.
  double value();
  /// Gradient at x, and the rows of the parts' own unknowns. Collective.
  void compute_residual(Vec residual);
  /// Force scale of the last residual [N]: the largest norm of a kind of force in the part furthest from balance, times
  /// the ratio of that part's StepPart::tolerance to `rtol`. Collective.
  double residual_scale(double rtol) const;
  /// Data of the prescribed volumes of all parts, as in StepPart. Not collective.
  Eigen::VectorXd volume_residual() const { return of_parts(&StepPart::volume_residual); }
  Eigen::VectorXd multiplier() const { return of_parts(&StepPart::multiplier); }
  Eigen::VectorXd pressure_scales() const { return of_parts(&StepPart::pressure_scales); }
  std::vector<int> prescribed() const;
  /// The norm of the last residual of the positions [N]. Collective.
  double residual_norm() const;
  /// Whether elements of any part can turn over. Not collective.
  bool inverts() const { return any(&StepPart::inverts); }
  /// StepPart::inverted, summed over the parts. Collective.
  double inverted(const Field& from, const Field& to) const;
  /// Changes the descent y of Newton's step from x to x - y: removes rounding in constrained directions, and shortens
  /// it as the potentials require (Potential::limit), vertex by vertex if their sum still falls along the shortened
  /// step, otherwise all vertices by the same fraction. Collective.
  void limit(Vec residual, Vec descent) const;
  /// Potential::refresh of all potentials. Collective.
  bool refresh();
  /// Tangent::update_pattern at x. Collective.
  bool update_pattern() { return tangent_->update_pattern(position_); }

  const Tangent& tangent() const { return *tangent_; }
  /// Number of columns of the low-rank part of the second derivative.
  int columns() const;
  /// Function that couples columns of several parts, such as gas that flows between objects.
  /// @param first column of each part @param left fraction of the indefinite terms that is kept, 0 to 1
  using Joint = std::function<void(LowRank& all, const std::vector<Eigen::Index>& first, double left)>;
  void set_joint(Joint joint) { joint_ = std::move(joint); }
  /// Sets the second derivative at x. Collective.
  /// @param system of the tangent's matrix, with `columns()` columns
  /// @param psd_blend as in StepPart::begin_tangent
  void update_tangent(LowRankSystem& system, double psd_blend);
  /// Whether the exact tangent can be moved towards the positive one by a fraction.
  bool blends() const;

  /// Whether RigidPatches suit any part (StepPart::suits_patches). Not collective.
  bool suits_patches() const { return any(&StepPart::suits_patches); }
  /// The part that follows arc length, or null. Not collective.
  StepPart* path() const { return parts_.front()->follows_path() ? parts_.front() : nullptr; }

  /// Largest of the parts' scales and roundings.
  double length_scale() const { return largest(&StepPart::length_scale); }
  double force_scale() const { return largest(&StepPart::force_scale); }
  double rounding() const { return largest(&StepPart::rounding); }

 private:
  MPI_Comm comm() const { return vertices().comm; }
  LowRank dense_tangent(double left);
  /// Positions of a part if those of all parts are x.
  const Field& place(std::size_t part, const Field& x, std::size_t which = 0) const;
  Eigen::VectorXd of_parts(Eigen::VectorXd (StepPart::*of)() const) const;
  bool any(bool (StepPart::*is)() const) const;
  double largest(double (StepPart::*of)() const) const;

  std::vector<StepPart*> parts_;
  Joint joint_;
  JoinedLayout joined_;
  std::deque<PartPotential> adapted_;   ///< potentials of each of several parts
  Potential* between_;                  ///< null: none
  std::vector<Potential*> potentials_;  ///< of all parts and between them, as functions of all positions
  std::unique_ptr<Tangent> tangent_;
  Field start_;  ///< if there is a potential between the parts
  Field position_;
  mutable std::vector<std::array<Field, 2>> places_;  ///< scratch: positions of each of several parts
  std::vector<double> squared_residuals_;  ///< this rank's fraction of each part's last squared residual [N^2]
  mutable std::vector<double> squares_;    ///< scratch: these and those of all forces
  Eigen::Matrix3Xd of_between_;            ///< the gradient of the potential between the parts
};

}  // namespace pellicle::energies
