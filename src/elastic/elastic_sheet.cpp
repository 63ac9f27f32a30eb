#include "elastic/elastic_sheet.h"

#include <algorithm>
#include <functional>

#include "parallel/collective.h"

namespace pellicle::elastic {

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
