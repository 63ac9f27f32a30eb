#include "linear/load_border.h"

#include <cmath>

#include "base/error.h"
#include "linear/shell_operations.h"

namespace pellicle {
inline namespace linear {

LoadBorder::LoadBorder(LowRankSystem& part) : Border(part, 1), load_(Eigen::VectorXd::Zero(part.rows())) {
  check(VecDuplicate(part_solution_, influence_.create()));
}

void LoadBorder::update(const Eigen::VectorXd& load, double scale) {
  load_ = load;
  scale_ = scale;
}

LinearResult LoadBorder::solve(Vec right_hand_side, Vec solution) {
  // S g.x = q, so that A x + l z = r + rho g q/S; x = a - z b with b = A^-1 l.
  const double wanted = border_values(right_hand_side)[0] / scale_;
  const Eigen::VectorXd row = part_.low_rank().column(last());
  VecValues{part_right_hand_side_} =
      ConstVecValues{right_hand_side}.head(rows()) + part_.low_rank().coefficients[last()] * wanted * row;
  LinearResult result = part_.solve(part_right_hand_side_, part_solution_);
  if (!result.converged) {
    return result;
  }
  const int iterations = result.iterations;
  copy_to(part_right_hand_side_, load_);
  result = part_.solve(part_right_hand_side_, influence_);
  result.iterations += iterations;
  if (!result.converged) {
    return result;
  }
  const Eigen::VectorXd along = part_.column_products({part_solution_, influence_}).row(last());
  const double load = (along[0] - wanted) / along[1];
  if (!std::isfinite(load)) {
    result.refuse(Solved::no, "the loads do not change any more");
    return result;
  }
  check(VecAXPY(part_solution_, -load, influence_));
  join(solution, Eigen::VectorXd::Constant(1, load));
  return result;
}

void LoadBorder::multiply(Vec x, Vec y) {
  const double load = border_values(x)[0];
  const Eigen::VectorXd products = multiply_part(x);
  Eigen::VectorXd weights = part_.low_rank().coefficients.cwiseProduct(products);
  weights[last()] = 0;
  VecValues{part_solution_} += part_.low_rank().times(weights);
  VecValues{part_solution_} += load * load_;
  join(y, Eigen::VectorXd::Constant(1, scale_ * products[last()]));
}

}  // namespace linear
}  // namespace pellicle
