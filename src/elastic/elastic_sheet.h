#pragma once

#include <array>
#include <optional>
#include <vector>

#include "elastic/bending_potential.h"
#include "elastic/elastic_options.h"
#include "elastic/spring_sheet.h"

namespace pellicle {
inline namespace elastic {

/// The part of a step of a sheet as a material: a SpringSheet whose springs have the material's tensile and shear
/// stiffness (SheetSprings), and which resists bending, with viscosity relative to the step's start.
///
/// With a strain limit (StrainLimit) its energy is continued smoothly beyond a share of the limit, and balanced again
/// with a larger share, until no spring is beyond that share, where the energy is the exact one. So a step may start
/// beyond the limit.
///
/// Its springs shrink with the mean of its layers; the difference between the layers bends it.
class ElasticSheet : public SpringSheet {
 public:
  /// The sheet must outlive it. Collective.
  /// @param layer_distance see BendingPotential @param factors of the material's textures
  /// @param pinned local particles that are never to move @param clamped those of the pinned at which an edge keeps its
  /// direction @param others what else acts on the particles' positions; must outlive it
  ElasticSheet(const Sheet& sheet, const SheetMaterial& material, double layer_distance, const MaterialFactors& factors,
               const std::vector<bool>& pinned, const std::vector<bool>& clamped, const ElasticOptions& options,
               const std::vector<Potential*>& others = {});

  void set_shape(const SheetInput& input) override;
  double largest_excess() const override;
  std::vector<const Potential*> of_shape() const override { return {&springs_, &bending_}; }

 private:
  const std::array<std::vector<double>, 4>& stiffness(const Living& living) override {
    return material_.stiffness(living);
  }
  double own_elastic_energy(const Field& positions) const override {
    return SpringSheet::own_elastic_energy(positions) + bending_.value(positions) - bending_.viscous_energy(positions);
  }
  double own_viscous_energy(const Field& positions) const override {
    return SpringSheet::own_viscous_energy(positions) + bending_.viscous_energy(positions);
  }

  double layer_distance_;
  std::array<double, 2> bending_stiffness_;
  std::vector<double> bending_factor_;  ///< of the local particles
  std::optional<StrainLimit> limit_;
  SheetSprings material_;
  BendingPotential bending_;
  std::vector<double> bent_factor_;  ///< on the bending stiffness of the local particles in the present step, with char
};

}  // namespace elastic
}  // namespace pellicle
