#include "elastic/mass_part.h"

#include <cmath>
#include <limits>
#include <numeric>

#include "parallel/collective.h"

namespace pellicle {
inline namespace elastic {

MassPart::MassPart(const Surface& surface, const std::vector<bool>& pinned, double tolerance, double usual_h,
                   const std::vector<Potential*>& others)
    : surface_(surface),
      tolerance_(tolerance),
      inertia_(surface.particles),
      potentials_{&inertia_},
      projectors_(pinned.size()),
      part_(3, surface.particles.owned),
      before_(surface.particles, 3),
      position_(surface.particles, 3) {
  potentials_.insert(potentials_.end(), others.begin(), others.end());
  for (std::size_t i = 0; i < pinned.size(); ++i) {
    if (pinned[i]) {
      projectors_.bind(i, Eigen::Matrix3d::Zero());
    }
  }
  place_ = surface.rest.cols() > 0 ? surface.rest.cwiseAbs().maxCoeff() : 0;
  MPI_Allreduce(MPI_IN_PLACE, &place_, 1, MPI_DOUBLE, MPI_MAX, surface.comm());
  double mass =
      std::accumulate(surface.initial_mass.begin(), surface.initial_mass.begin() + surface.particles.owned, 0.0);
  MPI_Allreduce(MPI_IN_PLACE, &mass, 1, MPI_DOUBLE, MPI_SUM, surface.comm());
  mean_mass_ = mass / static_cast<double>(surface.particles.global);
  h_ = usual_h;
  force_scale_ = mean_mass_ / (usual_h * usual_h) * place_;
}

double MassPart::rounding_of(double stiffness) const {
  return 10 * std::numeric_limits<double>::epsilon() * std::sqrt(3.0 * surface_.particles.global) * stiffness * place_;
}

void MassPart::set_masses(const Field& positions, const MassInput& input) {
  // A removed particle has neither mass nor springs: any stiffness keeps it where it is.
  const auto mass = [&](std::size_t i) { return input.mass[i] > 0 ? input.mass[i] : surface_.initial_mass[i]; };
  inertia_.set(positions, mass, input.h);
  h_ = input.h;
}

void MassPart::begin(const Field& positions, const MassInput& input) {
  set_masses(positions, input);
  held_ = input.held;
  before_.values() = input.start.values();
  position_.values() = positions.values();
  for (Potential* potential : potentials_) {
    potential->start_from(before_, position_, input.h);
  }
}

bool MassPart::leaves_held_behind() {
  bool leaves = false;
  for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
    leaves = leaves || (held_[static_cast<std::size_t>(i)] && position_.vector(i) != inertia_.free().col(i));
  }
  return on_any_rank(surface_.comm(), leaves);
}

double MassPart::value() {
  double sum = 0;
  for (const Potential* potential : potentials_) {
    sum += potential->value(position_);
  }
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, surface_.comm());
  return sum;
}

/// A removed particle feels its inertia alone.
Eigen::Matrix3Xd MassPart::gradient() {
  squares_.clear();
  Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, surface_.particles.owned);
  for (const Potential* potential : potentials_) {
    part_.setZero();
    potential->add_gradient(position_, part_);
    projectors_.apply(part_);
    squares_.push_back(part_.squaredNorm());
    sum += part_;
  }
  return sum;
}

}  // namespace elastic
}  // namespace pellicle
