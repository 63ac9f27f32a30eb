#pragma once

#include <deque>

#include "world/options.h"

namespace pellicle {
inline namespace world {

/// Gives every link of a run to the objects whose chambers it joins, and to no others. An end is a chamber of the
/// object in whose options the link is, or OBJECT.CHAMBER, or the ambient air; afterwards only ends in another object
/// are written OBJECT.CHAMBER. A link at the top of a deck is a single link, however many objects it is given to.
/// @throws Error that names object, link and key: an object that does not exist, links of one name that differ
void share_links(std::deque<ObjectOptions>& objects);

}  // namespace world
}  // namespace pellicle
