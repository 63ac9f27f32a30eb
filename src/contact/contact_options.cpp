#include "contact/contact_options.h"

namespace pellicle {
inline namespace contact {

void describe(OptionTable& table, ContactOptions& options, const Condition& bodies, const Condition& body_friction) {
  const auto either = [&options](const Condition& other, const std::string& words, bool needs_friction) {
    return Condition{words, [&options, other, needs_friction] {
                       return (options.self && (!needs_friction || options.friction > 0)) || other.holds();
                     }};
  };
  table.add("contact.self", options.self)
      .help("surfaces touch themselves, no part passes through another; objects that have it touch each other, too");
  table.add("contact.start", options.start)
      .acts_with({"contact.self: true", [&options] { return options.self; }})
      .help(
          "surfaces that pass through themselves or each other at the start: accept: what is crossed stays so; "
          "untangle: moves them until nothing crosses and they are as far apart as contact keeps them; refuse: no run");
  table.add("contact.check", options.check)
      .help("counts after every step the pairs of drawn triangles that cut through each other (history: crossings)");
  table.add("contact.thickness", options.thickness)
      .unit("m")
      .more_than(0)
      .acts_with(either(bodies, "bodies, or contact.self", false))
      .help(
          "gap at which surfaces begin to press: two parts of a surface, by half of their undeformed distance at most, "
          "and bodies, beyond their margin; of parts at most ten mean sides of the mesh; unless given a fifth of that "
          "side, for bodies a tenth")
      .source("docs/theory.md: parameters");
  table.add("contact.friction", options.friction)
      .at_least(0)
      .acts_with({"contact.self: true", [&options] { return options.self; }})
      .help("coefficient of Coulomb friction between parts of a surface");
  table.add("contact.stiffness", options.stiffness)
      .unit("Pa/m")
      .more_than(0)
      .acts_with(either(bodies, "bodies, or contact.self", false))
      .help(
          "c of the pressure with which surfaces press whose gap g is less than contact.thickness d: c (d - g)^2/(2 "
          "d); of bodies c (0.975 d - g) where g < 0.95 d, then falling smoothly to 0 at d: unless given much stiffer "
          "than the mesh in the plane and its mass in a step; of two objects the softer counts")
      .source("docs/theory.md: parameters");
  table.add("contact.slip_speed", options.slip_speed)
      .unit("m/s")
      .more_than(0)
      .acts_with(either(body_friction, "a body with friction, or contact.friction", true))
      .help("along a surface: friction grows up to this speed, at which it is Coulomb's")
      .source("docs/theory.md: parameters");
}

}  // namespace contact
}  // namespace pellicle
