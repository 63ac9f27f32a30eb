#include "energies/part_potential.h"

#include <cmath>

#include "parallel/collective.h"

namespace pellicle::energies {

PartPotential::PartPotential(Potential& potential, const JoinedLayout& joined, std::size_t part, const Layout& vertices)
    : potential_(potential), joined_(joined), part_(part), vertices_(vertices), place_(vertices, 3) {}

void PartPotential::add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  own_.setZero(3, vertices_.owned);
  potential_.add_gradient(taken(x), own_);
  gradient.middleCols(joined_.first_owned(part_), vertices_.owned) += own_;
}

std::vector<VertexPair> PartPotential::pattern() const {
  std::vector<VertexPair> pairs = potential_.pattern();
  for (VertexPair& pair : pairs) {
    pair = {joined_.local(part_, pair.row), joined_.global(part_, pair.column)};
  }
  return pairs;
}

bool PartPotential::limit(const Field& x, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) {
  auto own = step.middleCols(joined_.first_owned(part_), vertices_.owned);
  if (how != StepLimit::all_alike) {
    return potential_.limit(taken(x), how, own);
  }
  const double before = sum_over_ranks(vertices_.comm, own.squaredNorm());
  const bool limits = potential_.limit(taken(x), how, own);
  const double after = sum_over_ranks(vertices_.comm, own.squaredNorm());
  if (after < before) {  // The steps of the other parts are shortened by the same fraction.
    const Eigen::Matrix3Xd shortened = own;
    step *= std::sqrt(after / before);
    own = shortened;
  }
  return limits;
}

void PartPotential::add_product(const double* w, double* result) const {
  const PetscInt local = vertices_.local();
  own_.resize(3, local);
  more_.setZero(3, local);
  for (PetscInt i = 0; i < local; ++i) {
    own_.col(i) = Eigen::Map<const Eigen::Vector3d>(w + 3 * joined_.local(part_, i));
  }
  potential_.add_product(own_.data(), more_.data());
  for (PetscInt i = 0; i < local; ++i) {
    Eigen::Map<Eigen::Vector3d>(result + 3 * joined_.local(part_, i)) += more_.col(i);
  }
}

}  // namespace pellicle::energies
