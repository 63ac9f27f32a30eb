#pragma once

#include <vector>

#include "contact/contact_surface.h"
#include "surface/split_corners.h"

namespace pellicle {
inline namespace contact {

/// Gap, as a share of the thickness, at which things that are in one place undeformed, such as the lips of a crack,
/// begin to press.
constexpr double lip_share = 0.05;

/// Persistent ids of the corners that are split and of their copies, of all ranks, sorted. Collective.
std::vector<PetscInt> parted_ids(const Surface& surface, const SplitCorners& corners);

/// Moves the lips of fresh cracks apart, since surfaces in one place have no side of each other on which they could be
/// kept: each of the particles moves towards the middle of the living triangles round it by `lip_share` of the
/// thickness. Collective.
/// @param part whose surface is that with the copies @param living of its drawn triangles
/// @param ids see parted_ids @param held local particles that stay where they are
/// @param position ghosts up to date before and after
void open_lips(const ContactSurface::Part& part, const std::vector<bool>& living, const std::vector<PetscInt>& ids,
               const std::vector<bool>& held, Field& position);

}  // namespace contact
}  // namespace pellicle
