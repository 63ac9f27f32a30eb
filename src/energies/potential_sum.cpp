#include "energies/potential_sum.h"

#include <utility>

namespace pellicle {
inline namespace energies {

void PotentialSum::evaluate(const std::vector<Potential*>& potentials, const Projectors& projectors, const Field& x,
                            PetscInt owned) {
  if (std::exchange(is_evaluated_, true)) {
    return;
  }
  value_ = 0;
  squares_.clear();
  gradient_.setZero(3, owned);
  for (const Potential* potential : potentials) {
    of_potential_.setZero(3, owned);
    value_ += potential->add_value_and_gradient(x, of_potential_);
    projectors.apply(of_potential_);
    squares_.push_back(of_potential_.squaredNorm());
    gradient_ += of_potential_;
  }
}

}  // namespace energies
}  // namespace pellicle
