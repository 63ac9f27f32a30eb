#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "ablation/ablation.h"
#include "base/stage_clock.h"
#include "base/stage_result.h"
#include "contact/bodies.h"
#include "heat/conduction.h"
#include "world/burning_fields.h"
#include "world/object_state.h"
#include "world/options.h"
#include "world/textures.h"

namespace pellicle {
inline namespace world {

/// Heats, burns and cuts a surface, be it of a sheet or of a balloon: the stages heat, combustion and ablation of the
/// burning paper. They read and leave fields with ghosts up to date; time and positions come from the state that these
/// fields belong to.
class Burning {
 public:
  /// Reads textures, builds operators. Surface, options and clock must outlive it. Collective.
  /// @throws Error on textures that cannot be read or are asked for on a surface without texture coordinates, and on
  /// contradicting options
  Burning(const Surface& surface, const Options& options, StageClock& clock, Textures& textures);

  /// Sets temperatures, pieces and heat at time 0. Collective.
  void begin(BurningFields& fields) const;

  // The stages of a step of length h [s]. Collective.

  StageResult heat(BurningFields& fields, const ObjectState& state, double h);
  void combustion(BurningFields& fields, double h);
  /// Removes from the surface what has burnt. @returns whether there was anything, on any rank
  bool ablation(BurningFields& fields, const ObjectState& state, double h);
  /// Cracks the surface. @param sides see Ablation::crack @returns whether there is one, on any rank
  bool crack(BurningFields& fields, const std::vector<PetscInt>& sides);
  /// Updates springs, and triangles of other ranks, from the triangles of the owned elements.
  void follow(BurningFields& fields) { ablation_.follow_triangles(fields.living); }

  /// Whether all heat is accounted for, with the heat that the umbrella makes; the consistent operator may make none.
  /// Collective.
  StageResult heat_ledger(const BurningFields& fields) const;

 private:
  void take_out(BurningFields& fields, double time);

  const Surface& surface_;
  const Options& options_;
  StageClock& clock_;
  std::vector<double> mass_loss_factor_;                       ///< of the local particles, or empty
  std::map<std::string, std::vector<double>> source_texture_;  ///< sampled values of the heat textures
  std::vector<Body> bodies_;                                   ///< if any of them exchanges heat
  double resting_gap_ = 0;                                     ///< at which the surface comes to rest on them [m]
  Conduction conduction_;
  Ablation ablation_;
  Field rise_;                 ///< of the temperatures by conduction [K]
  std::vector<double> level_;  ///< see level_set
};

}  // namespace world
}  // namespace pellicle
