#pragma once

#include <vector>

#include "energies/potential.h"
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

}  // namespace pellicle::energies
