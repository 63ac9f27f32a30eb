#pragma once

#include <optional>

#include "base/options.h"

namespace pellicle {
inline namespace contact {

/// How surfaces press on bodies, on each other and on themselves.
struct ContactOptions {
  bool self = false;                ///< whether drawn surfaces keep apart from each other and from themselves
  std::optional<double> thickness;  ///< gap at which two surfaces begin to press [m]; none: a share of the mean side
  std::optional<double>
      stiffness;             ///< pressure over depth [Pa/m]; none: see below, of bodies usual_stiffness_of_bodies
  double friction = 0;       ///< Coulomb's coefficient between surfaces
  bool together = false;     ///< several objects do so, which touch each other: follows from their `self`
  bool check = false;        ///< count after every step where surfaces pass through themselves
  double slip_speed = 1e-3;  ///< relative to each other, from which on friction is Coulomb's in full [m/s]

  /// Between surfaces [Pa/m].
  double surface_stiffness() const { return stiffness.value_or(1e8); }
};

/// @param bodies whether there are bodies on which contact.stiffness acts @param body_friction with friction
void describe(OptionTable& table, ContactOptions& options, const Condition& bodies, const Condition& body_friction);

}  // namespace contact
}  // namespace pellicle
