#pragma once

#include <optional>
#include <vector>

#include "contact/surface_contact.h"
#include "world/object.h"

namespace pellicle {
inline namespace world {

/// Adds how an object touches itself to its row of the history. Collective.
/// @param apart see Object::report
/// @param figures at the end of the last step, if there was one
void report_contact(Report& report, const ContactOptions& options, bool apart,
                    const std::optional<ContactFigures>& figures, const Surface& surface, const State& state);

/// Moves the crack faces of fresh cracks apart, if there are any, see contact/crack faces.h. Collective.
/// @param objects all that touch each other
void separate_crack_faces(const std::vector<Object*>& objects);

}  // namespace world
}  // namespace pellicle
