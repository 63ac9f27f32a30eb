#pragma once

#include <string>
#include <vector>

#include "contact/contact_surface.h"
#include "world/object.h"

namespace pellicle::world {

/// Counts crossings and acts as `contact.start` says: only counts, or refuses surfaces that pass through themselves or
/// each other, or moves them until they do not (contact/untangle.h), and then apart until they hardly press.
/// Collective.
/// @returns a message; empty: nothing crossed
/// @throws Error naming objects, elements and place, if crossings are refused or cannot be removed, and if a thickness
/// is more than ten mean sides of its mesh
std::string settle_start(const ContactOptions& options, const std::vector<Object*>& objects);
/// Refuses an object that starts inside a body. Collective. @throws Error that names particle or triangle, and body
void refuse_start_in_bodies(Object& object);

}  // namespace pellicle::world
