#include "elastic/elastic_sheet.h"

#include <algorithm>
#include <functional>

namespace pellicle::elastic {

ElasticSheet::ElasticSheet(const Sheet& sheet, const SheetMaterial& material, double layer_distance,
                           const MaterialFactors& factors, const std::vector<bool>& pinned,
                           const std::vector<bool>& clamped, const ElasticOptions& options,
                           const std::vector<Potential*>& others)
    : SheetPart(sheet, material.damping, options.snes_rtol, pinned, options.usual_h, others),
      layer_distance_(layer_distance),
      bending_stiffness_(stiffness_of(material).bending),
      bending_factor_(factors.bending),
      in_plane_(sheet, stiffness_of(material), material.warp, factors),
      bending_(sheet, material.warp, clamped) {
  std::vector<Potential*> own{&in_plane_, &bending_};
  if (options.strain_limit) {
    const std::array<double, 2> tensile = stiffness_of(material).tensile;
    limit_ = StrainLimit{*options.strain_limit, std::max(tensile[0], tensile[1])};
    own.push_back(&limited_.emplace(sheet));
  }
  potentials_.insert(potentials_.begin(), own.begin(), own.end());
  if (bending_factor_.empty()) {
    bending_factor_.assign(sheet.particles.local(), 1);
  }
  set_scales();
}

void ElasticSheet::set_shape(const SheetInput& input) {
  const double viscosity = damping_ / input.damping_h;
  in_plane_.begin_step(input.active, input.y_v, {input.shrinkage, input.stiffness_factor, viscosity});
  bent_factor_.resize(bending_factor_.size());
  std::transform(bending_factor_.begin(), bending_factor_.end(), input.stiffness_factor.begin(), bent_factor_.begin(),
                 std::multiplies<>());
  bending_.begin_step(input.active, input.y_v,
                      {input.shrinkage, layer_distance_, bending_stiffness_, bent_factor_, viscosity});
  if (limited_) {
    limited_->set([&](Colour colour, std::size_t s) -> SpringPotential::Hooke {
      return {0, input.target_length[colour][s]};
    });
    limited_->set_limit(limit_, input.target_length, input.active.springs);
  }
}

std::vector<const Potential*> ElasticSheet::of_shape() const {
  std::vector<const Potential*> result{&in_plane_, &bending_};
  if (limited_) {
    result.push_back(&*limited_);
  }
  return result;
}

double ElasticSheet::own_elastic_energy(const Field& positions) const {
  return in_plane_.elastic_energy(positions) + bending_.value(positions) - bending_.viscous_energy(positions) +
         (limited_ ? limited_->elastic_energy(positions) : 0);
}

}  // namespace pellicle::elastic
