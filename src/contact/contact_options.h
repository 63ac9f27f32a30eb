#pragma once

#include <optional>

#include "base/options.h"

namespace pellicle {
inline namespace contact {

/// How surfaces press on bodies, on each other and on themselves.
struct ContactOptions {
  bool self = false;                ///< whether drawn surfaces keep apart from each other and from themselves
  std::optional<double> thickness;  ///< gap at which two surfaces begin to press [m]; none: a share of the mean side
  double stiffness = 1e8;           ///< pressure over depth [Pa/m]
  double friction = 0;              ///< Coulomb's coefficient between surfaces
  double slip_speed = 1e-3;         ///< relative to each other, from which on friction is Coulomb's in full [m/s]
};

void describe(OptionTable& table, ContactOptions& options);

}  // namespace contact
}  // namespace pellicle
