#pragma once

#include <Eigen/Core>
#include <vector>

#include "parallel/field.h"
#include "state/field_registry.h"
#include "surface/active_set.h"
#include "surface/pieces.h"

namespace pellicle::world {

/// The fields of a surface that heats, burns and is cut, declared in the registry of its state.
struct BurningFields {
  /// Everything lives and has its initial mass; temperatures and pieces are not set yet. The registry must outlive
  /// it. Collective.
  BurningFields(FieldRegistry& registry, const Surface& surface);

  Field& temperature;
  Field& mass;         ///< 0: the particle has been removed from the surface
  Field& mass_change;  ///< of the last step, at most 0
  Pieces& pieces;
  std::vector<double>& burn_time;  ///< when each local element began to burn away; -1: not yet
  ActiveSet& active;
  double& mass_burnt;  ///< since the beginning, by the owned particles, with what was left when they left
  // Since the beginning, each side counted by the rank that had it.
  double& cracked_sides;
  double& crack_length;  ///< undeformed
  // Heat ledger, of the owned particles: the content is initial + in - out + made.
  double& heat_initial;          ///< by the particles owned at the beginning
  double& heat_in;               ///< from sources, burning and warmer surroundings
  double& heat_out;              ///< to cooler surroundings and with what burnt
  double& heat_made;             ///< by conduction that does not conserve it
  Eigen::VectorXd& fire_record;  ///< FireRecord::numbers
};

}  // namespace pellicle::world
