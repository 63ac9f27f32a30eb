#include "contact/contact_options.h"

namespace pellicle::contact {

void describe(OptionTable& table, ContactOptions& options, const Condition& bodies, const Condition& body_friction) {
  const Condition touches{"bodies, or contact.self", [&options, bodies] { return options.self || bodies.holds(); }};
  const Condition rubs{"a body with friction, or contact.friction", [&options, body_friction] {
                         return (options.self && options.friction > 0) || body_friction.holds();
                       }};
  const Condition touches_itself{"contact.self: true", [&options] { return options.self; }};
  table.add("contact.self", options.self,
            "surfaces touch themselves, no part passes through another; objects that have it touch each other, too");
  table.add(
      "contact.start", options.start, Rules().acts_with(touches_itself),
      "surfaces that pass through themselves or each other at the start: accept: what is crossed stays so; untangle: "
      "moves them until nothing crosses and they are as far apart as contact keeps them; refuse: no run");
  table.add("contact.check", options.check,
            "counts after every step the pairs of drawn triangles that cut through each other (history: crossings)");
  table.add("contact.thickness", options.thickness, Rules("m").more_than(0).acts_with(touches),
            "gap at which surfaces begin to press: two parts of a surface, by half of their undeformed distance at "
            "most, and bodies, beyond their margin; of parts at most ten mean sides of the mesh; unless given a fifth "
            "of that side, for bodies a tenth",
            "docs/theory.md: parameters");
  table.add("contact.friction", options.friction, Rules().at_least(0).acts_with(touches_itself),
            "coefficient of Coulomb friction between parts of a surface");
  table.add("contact.stiffness", options.stiffness, Rules("Pa/m").more_than(0).acts_with(touches),
            "c of the pressure with which surfaces press whose gap g is less than contact.thickness d: c (d - g)^2/(2 "
            "d); of bodies c (0.975 d - g) where g < 0.95 d, then falling smoothly to 0 at d: unless given much "
            "stiffer than the mesh in the plane and its mass in a step; of two objects the softer counts",
            "docs/theory.md: parameters");
  table.add("contact.slip_speed", options.slip_speed, Rules("m/s").more_than(0).acts_with(rubs),
            "along a surface: friction grows up to this speed, at which it is Coulomb's", "docs/theory.md: parameters");
}

}  // namespace pellicle::contact
