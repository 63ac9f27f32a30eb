#pragma once

#include <array>
#include <optional>
#include <vector>

#include "elastic/bending_potential.h"
#include "elastic/elastic_options.h"
#include "elastic/spring_sheet.h"

namespace pellicle::elastic {

/// StepPart of a sheet as a material: a SpringSheet with the material's tensile and shear stiffness (SheetSprings),
/// bending stiffness, and viscosity relative to the step's start.
///
/// The energy of a strain limit (StrainLimit) is continued smoothly beyond a fraction of the limit; the step is
/// balanced again with larger shares until no spring is beyond the fraction, so that the energy is exact. So a step may
/// start beyond the limit.
///
/// The springs shrink with the mean of both layers; the difference between the layers bends the sheet.
class ElasticSheet : public SpringSheet {
 public:
  /// The sheet must outlive this object. Collective.
  /// @param layer_distance as in BendingPotential::Input @param factors of the material's textures
  /// @param pinned local particles that never move @param clamped pinned particles at which an edge keeps its direction
  /// @param others further potentials of the particles' positions; must outlive this object
  ElasticSheet(const Sheet& sheet, const SheetMaterial& material, double layer_distance, const MaterialFactors& factors,
               const std::vector<bool>& pinned, const std::vector<bool>& clamped, const ElasticOptions& options,
               const std::vector<Potential*>& others = {});

  void set_shape(const SheetInput& input) override;
  /// Largest ratio of the stiffness along a side of a cell to the given one, over all ranks. Collective.
  double largest_excess() const;
  std::vector<const Potential*> of_shape() const override { return {&springs_, &bending_}; }

 private:
  const std::array<std::vector<double>, 4>& stiffness(const ActiveSet& active) override {
    return material_.stiffness(active);
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

}  // namespace pellicle::elastic
