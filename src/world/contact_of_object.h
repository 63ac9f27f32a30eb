#pragma once

#include <optional>
#include <vector>

#include "contact/surface_contact.h"
#include "io/history.h"

namespace pellicle {
inline namespace world {

// What history says of how an object touches itself, be it a sheet or a balloon.

/// The columns of its history.
std::vector<History::Column> contact_columns(const ContactOptions& options);

/// Their values. Collective.
/// @param contact if it can touch itself
/// @param living of the surface's drawn triangles; null: all of them
std::vector<double> contact_values(const ContactOptions& options, const std::optional<SurfaceContact>& contact,
                                   const Surface& surface, const Field& position, const std::vector<bool>* living);

}  // namespace world
}  // namespace pellicle
