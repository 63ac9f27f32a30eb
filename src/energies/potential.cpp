#include "energies/potential.h"

#include <algorithm>

#include "parallel/collective.h"

namespace pellicle {
inline namespace energies {

void limit_step(MPI_Comm comm, const std::vector<Potential*>& potentials, const Field& x,
                const Eigen::Ref<const Eigen::Matrix3Xd>& gradient, Eigen::Ref<Eigen::Matrix3Xd> step) {
  if (std::none_of(potentials.begin(), potentials.end(),
                   [](const Potential* potential) { return potential->limits(); })) {
    return;
  }
  const auto shorten = [&](StepLimit how) {
    bool is_shortened = false;
    for (Potential* potential : potentials) {
      is_shortened = potential->limit(x, how, step) || is_shortened;
    }
    return is_shortened;
  };
  const Eigen::Matrix3Xd whole = step;
  if (!shorten(StepLimit::each_vertex)) {
    return;
  }
  const double slope = sum_over_ranks(comm, step.cwiseProduct(gradient).sum());
  if (!(slope < 0)) {
    step = whole;
    shorten(StepLimit::all_alike);
  }
}

}  // namespace energies
}  // namespace pellicle
