#include "contact/contact_options.h"

namespace pellicle {
inline namespace contact {

void describe(OptionTable& table, ContactOptions& options, const Condition& bodies, const Condition& body_friction) {
  const Condition touches{"contact.self: true", [&options] { return options.self; }};
  const auto either = [&options](const Condition& other, const std::string& words, bool needs_friction) {
    return Condition{words, [&options, other, needs_friction] {
                       return (options.self && (!needs_friction || options.friction > 0)) || other.holds();
                     }};
  };
  table.add("contact.self", options.self)
      .help("surfaces touch themselves, no part passes through another; objects that have it touch each other, too");
  table.add("contact.check", options.check)
      .help("counts after every step the pairs of drawn triangles that cut through each other (history: crossings)");
  table.add("contact.thickness", options.thickness)
      .unit("m")
      .more_than(0)
      .acts_with(touches)
      .help(
          "gap at which two parts of a surface begin to press on each other, by half of their undeformed distance at "
          "most; unless given a fifth of the mean side of the mesh")
      .source("README: parameters");
  table.add("contact.friction", options.friction)
      .at_least(0)
      .acts_with(touches)
      .help("coefficient of Coulomb friction between parts of a surface");
  table.add("contact.stiffness", options.stiffness)
      .unit("Pa/m")
      .more_than(0)
      .acts_with(either(bodies, "bodies, or contact.self", false))
      .help(
          "pressure with which a body presses on a balloon, for each metre that a vertex is inside, and parts of a "
          "surface on each other, at half of the thickness")
      .source("README: parameters");
  table.add("contact.slip_speed", options.slip_speed)
      .unit("m/s")
      .more_than(0)
      .acts_with(either(body_friction, "a body with friction, or contact.friction", true))
      .help("along a surface: friction grows up to this speed, at which it is Coulomb's")
      .source("README: parameters");
}

}  // namespace contact
}  // namespace pellicle
