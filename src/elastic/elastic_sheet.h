#pragma once

#include <array>
#include <optional>
#include <vector>

#include "elastic/bending_potential.h"
#include "elastic/elastic_options.h"
#include "elastic/in_plane_potential.h"
#include "elastic/sheet_part.h"
#include "elastic/spring_potential.h"

namespace pellicle::elastic {

/// StepPart of a sheet as a material: it resists strain (InPlanePotential) and bending (BendingPotential), with a
/// viscosity relative to the step's start.
///
/// The energy of a strain limit (StrainLimit), which acts on the springs along the sides of the cells, is continued
/// smoothly beyond a fraction of the limit; the step is balanced again with larger shares until no spring is beyond the
/// fraction, so that the energy is exact. So a step may start beyond the limit.
///
/// The sheet shrinks with the mean of both layers; the difference between the layers bends it.
class ElasticSheet : public SheetPart {
 public:
  /// The sheet must outlive this object. Collective.
  /// @param layer_distance as in BendingPotential::Input @param factors of the material's textures
  /// @param pinned local particles that never move @param clamped pinned particles at which an edge keeps its direction
  /// @param others further potentials of the particles' positions; must outlive this object
  ElasticSheet(const Sheet& sheet, const SheetMaterial& material, double layer_distance, const MaterialFactors& factors,
               const std::vector<bool>& pinned, const std::vector<bool>& clamped, const ElasticOptions& options,
               const std::vector<Potential*>& others = {});

  void set_shape(const SheetInput& input) override;
  /// Stress of each local cell, viscosity included, a force per present width [N/m]. Not collective.
  std::vector<Eigen::Matrix3d> stress(const Field& positions) const { return in_plane_.stress(positions); }
  std::vector<const Potential*> of_shape() const override;

 private:
  double own_elastic_energy(const Field& positions) const override;
  double own_viscous_energy(const Field& positions) const override {
    return in_plane_.viscous_energy(positions) + bending_.viscous_energy(positions);
  }

  double layer_distance_;
  std::array<double, 2> bending_stiffness_;
  std::vector<double> bending_factor_;  ///< of the local particles
  InPlanePotential in_plane_;
  BendingPotential bending_;
  std::optional<StrainLimit> limit_;
  std::optional<SpringPotential> limited_;  ///< the springs that have the limit
  std::vector<double> bent_factor_;  ///< on the bending stiffness of the local particles in the present step, with char
};

}  // namespace pellicle::elastic
