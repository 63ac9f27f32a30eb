#pragma once

#include <optional>
#include <string>
#include <vector>

#include "contact/crossings.h"
#include "contact/surface_contact.h"
#include "geometry/projectors.h"
#include "io/history.h"
#include "world/object.h"
#include "world/object_state.h"

namespace pellicle {
inline namespace world {

// The part of the history about how an object, a sheet or a balloon, touches itself.

/// The columns of its history.
/// @param apart see ObjectOutput::contact_apart
std::vector<History::Column> contact_columns(const ContactOptions& options, bool apart);

/// Their values. Collective.
/// @param figures at the end of the last step, if there was one
/// @param living of the surface's drawn triangles; null: all of them
std::vector<double> contact_values(const ContactOptions& options, bool apart,
                                   const std::optional<ContactFigures>& figures, const Surface& surface,
                                   const ObjectState& state, const std::vector<bool>* living);

/// Moves the lips of fresh cracks apart, if there are any, see contact/lips.h. Collective.
/// @param objects all that touch each other
void open_lips(const std::vector<Object*>& objects);

}  // namespace world
}  // namespace pellicle
