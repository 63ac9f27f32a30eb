#include "elastic/sheet_part.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "base/handle.h"
#include "energies/tangent.h"
#include "parallel/collective.h"

namespace pellicle::elastic {

namespace {

/// Stiffness over inertia above which solves with rigid patches are faster than with the diagonal's blocks alone.
constexpr double worth_patches = 200;

}  // namespace

void SheetPart::set_scales() {
  std::array<std::vector<double>, 4> length;
  for (const Colour colour : all_colours) {
    length[colour] = sheet_.of(colour).initial_length;
  }
  Field rest(sheet_.particles, 3);
  rest.values() = sheet_.rest;
  const std::vector<double> ones(sheet_.particles.local(), 1);
  const ActiveSet all(sheet_);
  const SheetInput input{{sheet_.initial_mass, rest, h_}, length, ones, ones, all};
  set_shape(input);
  set_masses(rest, input);
  Tangent tangent(sheet_.particles, potentials_, projectors_, TangentMatrix::shell, "");
  tangent.update(rest, Curvature::psd);
  VecHandle diagonal;
  check(MatCreateVecs(tangent.matrix(), diagonal.create(), nullptr));
  double sum = 0;
  double norm = 0;
  check(MatGetDiagonal(tangent.matrix(), diagonal));
  check(VecSum(diagonal, &sum));
  check(VecNorm(diagonal, NORM_2, &norm));
  const double inertia =
      sum_over_ranks(sheet_.comm(), 3 * std::accumulate(inertia_.stiffness().begin(), inertia_.stiffness().end(), 0.0));
  const PetscInt moving =
      sheet_.layers == 1 ? sum_over_ranks(sheet_.comm(), sheet_.owned_corners) : sheet_.particles.global;
  rest_stiffness_ = norm / std::sqrt(3.0 * moving);
  force_scale_ = rest_stiffness_ * length_scale_;
  suits_patches_ = inertia > 0 && sum > worth_patches * inertia;
}

void SheetPart::begin(const Field& positions, const SheetInput& input) {
  set_shape(input);
  MassPart::begin(positions, input);
  if (sheet_.layers == 1) {
    follow_corners(sheet_, position_);
  }
}

bool SheetPart::move_to(const Field& position, const Eigen::VectorXd& own) {
  if (sheet_.layers == 2) {
    return MassPart::move_to(position, own);
  }
  followed_.values() = position.values();
  follow_corners(sheet_, followed_);
  return MassPart::move_to(followed_, own);
}

double SheetPart::rounding() const {
  return std::max(negligible_force_, rounding_of(rest_stiffness_ + mean_mass_ / (h_ * h_)));
}

double SheetPart::elastic_energy(const Field& positions) const {
  return sum_over_ranks(sheet_.comm(), own_elastic_energy(positions));
}

double SheetPart::viscous_work(const Field& positions) const {
  return sum_over_ranks(sheet_.comm(), -2 * own_viscous_energy(positions));
}

}  // namespace pellicle::elastic
