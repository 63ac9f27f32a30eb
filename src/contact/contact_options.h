#pragma once

#include <optional>
#include <string>
#include <vector>

#include "options/choice.h"
#include "options/options.h"

namespace pellicle::contact {

/// How a run treats surfaces that pass through themselves or each other at its start.
enum class ContactStart { accept, untangle, refuse };
inline std::vector<std::string> names_of(ContactStart) { return {"accept", "untangle", "refuse"}; }

/// Options of contact of surfaces with bodies, each other and themselves.
struct ContactOptions {
  bool self = false;                ///< whether drawn surfaces keep apart from each other and from themselves
  std::optional<double> thickness;  ///< gap below which surfaces press [m]; none: a fraction of the mean side
  std::optional<double> stiffness;  ///< pressure over depth [Pa/m]; none: usual_contact_stiffness
  double friction = 0;              ///< Coulomb's coefficient between surfaces
  Choice<ContactStart> start = ContactStart::accept;
  bool check = false;        ///< count after every step where surfaces pass through themselves
  double slip_speed = 1e-3;  ///< relative speed above which friction is Coulomb's in full [m/s]
};

/// @param bodies if contact.stiffness acts on bodies @param body_friction if a body has friction
void describe(OptionTable& table, ContactOptions& options, const Condition& bodies, const Condition& body_friction);

}  // namespace pellicle::contact
