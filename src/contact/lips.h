#pragma once

#include <vector>

#include "contact/contact_surface.h"
#include "surface/split_corners.h"

namespace pellicle {
inline namespace contact {

/// Gap, as a share of the thickness, at which things that are in one place undeformed, such as the lips of a crack,
/// begin to press.
constexpr double lip_share = 0.05;

/// A corner that is split, or one of its copies, by persistent ids.
struct Lip {
  PetscInt of = 0;  ///< the corner that is split
  PetscInt id = 0;
  bool operator<(const Lip& other) const { return of != other.of ? of < other.of : id < other.id; }
  bool operator==(const Lip& other) const { return of == other.of && id == other.id; }
};

/// All of them, of all ranks, sorted. Collective.
std::vector<Lip> find_lips(const Surface& surface, const SplitCorners& corners);

/// Moves the lips of fresh cracks apart, since surfaces in one place have no side of each other on which they could be
/// kept. Each goes towards the middle of the living triangles round it by `lip_share` of the thickness, unless these
/// would then cut through those round another lip of the same corner, as folded ones may: then it goes another way. It
/// goes less far where another part of the surface is near. Collective.
/// @param part whose surface is that with the copies @param living of its drawn triangles
/// @param lips see find_lips @param held local particles that stay where they are
/// @param position ghosts up to date before and after
void open_lips(const ContactSurface::Part& part, const std::vector<bool>& living, const std::vector<Lip>& lips,
               const std::vector<bool>& held, Field& position);

}  // namespace contact
}  // namespace pellicle
