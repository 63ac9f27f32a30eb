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
std::vector<History::Column> contact_columns(const ContactOptions& options);

/// Their values. Collective.
/// @param contact if it can touch itself @param figures at the end of the last step, if there was one
/// @param living of the surface's drawn triangles; null: all of them
std::vector<double> contact_values(const ContactOptions& options, const std::optional<SurfaceContact>& contact,
                                   const std::optional<ContactFigures>& figures, const Surface& surface,
                                   const ObjectState& state, const std::vector<bool>* living);

/// "3 pairs of triangles pass through each other, first of elements 4 and 9 at (1, 0, 2) m". @param names of the
/// objects whose surfaces were examined; empty ones are not said
std::string crossing_words(const Crossings& crossings, const std::vector<std::string>& names);
/// In words, what has passed through in a step because it touched, see SurfaceContact::anything_touched; empty: nothing
/// has. Collective.
/// @param before, after the surfaces of the step's start and end, of objects of these names
std::string passed_through(const SurfaceContact& contact, const std::vector<PlacedSurface>& before,
                           const std::vector<PlacedSurface>& after, const std::vector<std::string>& names);

/// Whether no particle is held on any rank, so that all particles of an object may move alike. Collective.
/// @param projectors of each local particle onto where it may go
bool can_move_alike(MPI_Comm comm, const Projectors& projectors);

/// Moves the lips of fresh cracks apart, if there are any, see contact/lips.h. Collective.
/// @param objects all that touch each other
void open_lips(const std::vector<TouchingObject*>& objects);

}  // namespace world
}  // namespace pellicle
