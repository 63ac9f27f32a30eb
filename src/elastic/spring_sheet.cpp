#include "elastic/spring_sheet.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "base/error.h"
#include "base/handle.h"
#include "parallel/collective.h"

namespace pellicle::elastic {

namespace {

/// Stiffness over inertia above which solves with rigid patches are faster than with the diagonal's blocks alone.
constexpr double worth_patches = 600;

/// Mean length of all springs of the undeformed sheet [m]. Collective.
double mean_length(const Sheet& sheet) {
  std::array<double, 2> length_and_count{};
  for (const SpringSet& set : sheet.springs) {
    length_and_count[0] += std::accumulate(set.initial_length.begin(), set.initial_length.begin() + set.owned(), 0.0);
    length_and_count[1] += set.owned();
  }
  length_and_count = sum_over_ranks(sheet.comm(), length_and_count);
  return length_and_count[0] / std::max(1.0, length_and_count[1]);
}

}  // namespace

SpringSheet::SpringSheet(const Sheet& sheet, double damping, double tolerance, const std::vector<bool>& pinned,
                         double usual_h, const std::vector<Potential*>& others)
    : MassPart(sheet, pinned, tolerance, usual_h, others), sheet_(sheet), damping_(damping), springs_(sheet) {
  potentials_.insert(potentials_.begin(), &springs_);
}

SpringSheet::SpringSheet(const Sheet& sheet, const SpringOptions& options, const std::vector<bool>& pinned,
                         double usual_h, const std::vector<Potential*>& others)
    : SpringSheet(sheet, options.damping, options.snes_rtol, pinned, usual_h, others) {
  equal_stiffness_ = options.stiffness;
  negligible_force_ = (1 + damping_ / usual_h) * options.stiffness * options.newton_tolerance *
                      options.newton_tolerance * mean_length(sheet);
  set_scales();
}

const std::array<std::vector<double>, 4>& SpringSheet::stiffness(const ActiveSet& active) {
  for (std::size_t colour = 0; colour < all_colours.size(); ++colour) {
    const std::vector<bool>& lives = active.springs[colour];
    equal_stiffnesses_[colour].resize(lives.size());
    std::transform(lives.begin(), lives.end(), equal_stiffnesses_[colour].begin(),
                   [this](bool is_alive) { return is_alive ? equal_stiffness_ : 0; });
  }
  return equal_stiffnesses_;
}

void SpringSheet::set_scales() {
  std::array<std::vector<double>, 4> length;
  for (const Colour colour : all_colours) {
    length[static_cast<std::size_t>(colour)] = sheet_.of(colour).initial_length;
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
  rest_stiffness_ = norm / std::sqrt(3.0 * sheet_.particles.global);
  force_scale_ = rest_stiffness_ * length_scale_;
  suits_patches_ = inertia > 0 && sum > worth_patches * inertia;
}

void SpringSheet::set_shape(const SheetInput& input) {
  const double damping = damping_ / input.damping_h;
  const std::array<std::vector<double>, 4>& stiffness = this->stiffness(input.active);
  springs_.set([&](Colour colour, std::size_t s) -> SpringPotential::Hooke {
    const auto index = static_cast<std::size_t>(colour);
    const SpringSet& set = sheet_.of(colour);
    const double intact = stiffness[index][s];
    if (intact == 0) {
      return {0, set.initial_length[s]};
    }
    const auto [a, b] = set.ends[s];
    const double k = intact * (input.stiffness_factor[a] + input.stiffness_factor[b]) / 2;
    const double l = input.target_length[index][s];
    return {k, l, {damping * k, damping > 0 ? (input.y_v.vector(a) - input.y_v.vector(b)).norm() : 0}};
  });
}

void SpringSheet::begin(const Field& positions, const SheetInput& input) {
  set_shape(input);
  MassPart::begin(positions, input);
}

double SpringSheet::rounding() const {
  return std::max(negligible_force_, rounding_of(rest_stiffness_ + mean_mass_ / (h_ * h_)));
}

const std::array<std::vector<bool>, 4>& SpringSheet::bearing_springs(const ActiveSet& active) {
  const std::array<std::vector<double>, 4>& stiffness = this->stiffness(active);
  for (std::size_t colour = 0; colour < all_colours.size(); ++colour) {
    bears_[colour].resize(sheet_.springs[colour].owned());
    std::transform(stiffness[colour].begin(), stiffness[colour].begin() + sheet_.springs[colour].owned(),
                   bears_[colour].begin(), [](double of_spring) { return of_spring > 0; });
  }
  return bears_;
}

double SpringSheet::elastic_energy(const Field& positions) const {
  return sum_over_ranks(sheet_.comm(), own_elastic_energy(positions));
}

double SpringSheet::viscous_work(const Field& positions) const {
  return sum_over_ranks(sheet_.comm(), -2 * own_viscous_energy(positions));
}

ElasticSheet::ElasticSheet(const Sheet& sheet, const SheetMaterial& material, double layer_distance,
                           const MaterialFactors& factors, const std::vector<bool>& pinned,
                           const std::vector<bool>& clamped, const ElasticOptions& options,
                           const std::vector<Potential*>& others)
    : SpringSheet(sheet, material.damping, options.snes_rtol, pinned, options.usual_h, others),
      layer_distance_(layer_distance),
      bending_factor_(factors.bending),
      material_(sheet, stiffness_of(material), material.warp, factors),
      bending_(sheet, material.warp, clamped) {
  const Stiffness stiffness = stiffness_of(material);
  bending_stiffness_ = stiffness.bending;
  potentials_.insert(potentials_.begin() + 1, &bending_);
  if (options.strain_limit) {
    limit_ = StrainLimit{*options.strain_limit, std::max(stiffness.tensile[0], stiffness.tensile[1])};
  }
  if (bending_factor_.empty()) {
    bending_factor_.assign(sheet.particles.local(), 1);
  }
  set_scales();
}

void ElasticSheet::set_shape(const SheetInput& input) {
  SpringSheet::set_shape(input);
  springs_.set_limit(limit_, input.target_length, input.active.springs);
  bent_factor_.resize(bending_factor_.size());
  std::transform(bending_factor_.begin(), bending_factor_.end(), input.stiffness_factor.begin(), bent_factor_.begin(),
                 std::multiplies<>());
  bending_.begin_step(input.active, input.y_v,
                      {input.shrinkage, layer_distance_, bending_stiffness_, bent_factor_, damping_ / input.damping_h});
}

double ElasticSheet::largest_excess() const { return max_over_ranks(sheet_.comm(), material_.largest_excess()); }

}  // namespace pellicle::elastic
