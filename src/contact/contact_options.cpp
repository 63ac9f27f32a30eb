#include "contact/contact_options.h"

namespace pellicle {
inline namespace contact {

void describe(OptionTable& table, ContactOptions& options) {
  table.add("contact.stiffness", options.stiffness)
      .unit("Pa/m")
      .more_than(0)
      .help("pressure with which a body presses on a balloon, for each metre that a vertex is inside")
      .source("README: parameters");
  table.add("contact.slip_speed", options.slip_speed)
      .unit("m/s")
      .more_than(0)
      .help("along a body: friction grows up to this speed, at which it is Coulomb's")
      .source("README: parameters");
}

}  // namespace contact
}  // namespace pellicle
