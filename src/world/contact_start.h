#pragma once

#include <string>
#include <vector>

#include "contact/contact_options.h"
#include "world/object.h"

namespace pellicle {
inline namespace world {

/// What touches, where a run starts.
struct StartingObject {
  std::string name;  ///< empty: the run has one object, without a name
  TouchingObject* object;
};

/// Counts crossings and does as `contact.start` says: no more than that, or refuses surfaces that pass through
/// themselves or each other, or moves them until they do not (contact/untangle.h), and then apart until they hardly
/// press. Collective.
/// @returns what is to be told; empty: nothing crossed
/// @throws Error naming objects, elements and place, on what is refused and on what stays tangled
std::string settle_start(const ContactOptions& options, const std::vector<StartingObject>& objects);
/// Of what touches itself alone.
inline std::string settle_start(const ContactOptions& options, TouchingObject& object) {
  return settle_start(options, {{"", &object}});
}

}  // namespace world
}  // namespace pellicle
