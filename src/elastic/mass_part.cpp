#include "elastic/mass_part.h"

#include <cmath>
#include <limits>
#include <numeric>

#include "parallel/collective.h"

namespace pellicle::elastic {

Inertia::Inertia(const Layout& vertices) : vertices_(vertices), free_(Eigen::Matrix3Xd::Zero(3, vertices.owned)) {
  rows_.entries.assign(vertices.owned, 0);
  rows_.columns.reserve(rows_.entries.size());
  rows_.offsets.reserve(rows_.entries.size() + 1);
  for (PetscInt i = 0; i < vertices.owned; ++i) {
    rows_.columns.push_back(i);
    rows_.offsets.push_back(i + 1);
  }
}

double Inertia::value(const Field& x) const {
  double sum = 0;
  for (PetscInt i = 0; i < vertices_.owned; ++i) {
    sum += rows_.entries[i] * (x.vector(i) - free_.col(i)).squaredNorm();
  }
  return sum / 2;
}

double Inertia::add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  double sum = 0;
  for (PetscInt i = 0; i < vertices_.owned; ++i) {
    const double stiffness = rows_.entries[i];
    const Eigen::Vector3d away = x.vector(i) - free_.col(i);
    gradient.col(i) += stiffness * away;
    sum += stiffness * away.squaredNorm();
  }
  return sum / 2;
}

void Inertia::add_hessian(const HessianBlocks& blocks) const {
  for (std::size_t i = 0; i < rows_.entries.size(); ++i) {
    blocks.add(i, rows_.entries[i] * Eigen::Matrix3d::Identity());
  }
}

MassPart::MassPart(const Surface& surface, const std::vector<bool>& pinned, double tolerance, double usual_h,
                   const std::vector<Potential*>& others)
    : PartOfPotentials(surface.particles, surface.triangles, tolerance),
      surface_(surface),
      inertia_(surface.particles),
      projectors_(pinned.size()),
      h_(usual_h) {
  potentials_.push_back(&inertia_);
  potentials_.insert(potentials_.end(), others.begin(), others.end());
  for (std::size_t i = 0; i < pinned.size(); ++i) {
    if (pinned[i]) {
      projectors_.bind(i, Eigen::Matrix3d::Zero());
    }
  }
  length_scale_ = max_over_ranks(surface.comm(), surface.rest.cols() > 0 ? surface.rest.cwiseAbs().maxCoeff() : 0.0);
  const double mass =
      std::accumulate(surface.initial_mass.begin(), surface.initial_mass.begin() + surface.particles.owned, 0.0);
  mean_mass_ = sum_over_ranks(surface.comm(), mass) / static_cast<double>(surface.particles.global);
  force_scale_ = mean_mass_ / (usual_h * usual_h) * length_scale_;
}

double MassPart::rounding_of(double stiffness) const {
  return 10 * std::numeric_limits<double>::epsilon() * std::sqrt(3.0 * surface_.particles.global) * stiffness *
         length_scale_;
}

void MassPart::set_masses(const Field& positions, const MassInput& input) {
  // A removed particle has neither mass nor springs: any stiffness keeps it where it is or where its quad carries it.
  const auto mass = [&](std::size_t i) { return input.mass[i] > 0 ? input.mass[i] : surface_.initial_mass[i]; };
  inertia_.set(positions, mass, input.inertia_h);
  h_ = input.inertia_h;
}

void MassPart::begin(const Field& positions, const MassInput& input) {
  set_masses(positions, input);
  forget();
  start_ = &input.start;
  position_.values() = positions.values();
  for (Potential* potential : potentials_) {
    potential->start_from(*start_, position_, input.h);
  }
}

bool MassPart::leaves_held_behind() {
  bool leaves = false;
  for (const PetscInt i : projectors_.bound()) {
    leaves = leaves || (i < surface_.particles.owned && position_.vector(i) != inertia_.free().col(i));
  }
  return on_any_rank(surface_.comm(), leaves);
}

}  // namespace pellicle::elastic
