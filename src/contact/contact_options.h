#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/choice.h"
#include "base/options.h"

namespace pellicle {
inline namespace contact {

/// What is done about surfaces that pass through themselves or each other at the start.
enum class ContactStart { accept, untangle, refuse };
inline const std::vector<std::string>& names_of(ContactStart) {
  static const std::vector<std::string> names{"accept", "untangle", "refuse"};
  return names;
}

/// How surfaces press on bodies, on each other and on themselves.
struct ContactOptions {
  bool self = false;                ///< whether drawn surfaces keep apart from each other and from themselves
  std::optional<double> thickness;  ///< gap at which two surfaces begin to press [m]; none: a share of the mean side
  std::optional<double> stiffness;  ///< pressure over depth [Pa/m]; none: see usual_contact_stiffness
  double friction = 0;              ///< Coulomb's coefficient between surfaces
  Choice<ContactStart> start = ContactStart::accept;
  bool check = false;        ///< count after every step where surfaces pass through themselves
  double slip_speed = 1e-3;  ///< relative to each other, above which friction is Coulomb's in full [m/s]
};

/// @param bodies whether there are bodies on which contact.stiffness acts @param body_friction with friction
void describe(OptionTable& table, ContactOptions& options, const Condition& bodies, const Condition& body_friction);

}  // namespace contact
}  // namespace pellicle
