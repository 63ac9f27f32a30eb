#include "energies/step_part.h"

#include <utility>

#include "parallel/collective.h"

namespace pellicle::energies {

bool PartOfPotentials::move_to(const Field& position, const Eigen::VectorXd& /*own*/) {
  const bool moves = on_any_rank(comm(), position_.values() != position.values());
  if (moves) {
    position_.values() = position.values();
    forget();
  }
  return moves;
}

double PartOfPotentials::value() {
  evaluate();
  return sum_over_ranks(comm(), value_);
}

void PartOfPotentials::evaluate() {
  if (std::exchange(is_evaluated_, true)) {
    return;
  }
  value_ = 0;
  squares_.clear();
  gradient_.setZero(3, owned());
  for (const Potential* potential : potentials_) {
    of_potential_.setZero(3, owned());
    value_ += potential->add_value_and_gradient(position_, of_potential_);
    projectors().apply(of_potential_);
    squares_.push_back(of_potential_.squaredNorm());
    gradient_ += of_potential_;
  }
}

}  // namespace pellicle::energies
