#pragma once

#include "combustion/combustion.h"
#include "parallel/field.h"
#include "surface/living.h"
#include "surface/pieces.h"
#include "surface/sheet.h"

namespace pellicle {

/// All that changes from step to step. Fields live on the sheet's particles, ghosts up to date between steps. A step
/// that fails is put back by assigning a copy: whatever is a member here is put back with it.
struct State {
  /// Everything lives and is at rest; the pieces are yet to be found. Collective.
  explicit State(const Sheet& sheet);

  double time = 0;    ///< [s]
  int step = 0;       ///< accepted steps
  Field position;     ///< x [m]
  Field velocity;     ///< v [m/s]
  Field temperature;  ///< T [K]
  Field mass;         ///< m [kg]; 0: the particle has left the sheet
  Field mass_change;  ///< of the last step, at most 0 [kg]
  TargetLengths target_length;
  Living living;
  Pieces pieces;
  std::vector<double> burn_time;  ///< when each local cell began to burn away or to tear [s]; -1: not yet
  double mass_burnt = 0;  ///< since the beginning, by the owned particles, with what was left when they left [kg]
  // Heat ledger, of the owned particles: the content is initial + in - out + made.
  double heat_initial = 0;  ///< at the beginning, by the particles that this rank owned then [J]
  double heat_in = 0;       ///< from sources, burning and warmer surroundings since the beginning [J]
  double heat_out = 0;      ///< to cooler surroundings and with the mass that burnt, likewise [J]
  double heat_made = 0;     ///< by an operator of conduction that does not conserve it, likewise [J]
};

}  // namespace pellicle
