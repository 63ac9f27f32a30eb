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

/// All lips of a surface on all ranks, sorted. Collective.
std::vector<Lip> find_lips(const Surface& surface, const SplitCorners& corners);

/// A surface that may have cracked, one of those that touch each other.
struct CrackedSurface {
  ContactSurface::Part part;        ///< its surface has the split corners
  const std::vector<bool>* living;  ///< of its drawn triangles; null: all of them
  std::vector<bool> held;           ///< local particles that stay where they are
  std::vector<Lip> lips;            ///< of fresh cracks, from find_lips
  Field& position;                  ///< ghosts up to date, before and after
};

/// Moves the lips of fresh cracks apart, since surfaces in one place have no side of each other on which they could be
/// kept. Each goes towards the middle of the living triangles round it by `lip_share` of the thickness, unless these
/// would then cut through those round another lip of the same corner, as in a fold: then it goes in another direction.
/// The way is shorter where another part of the surface, or another surface, is near. Collective.
/// @param surfaces all that touch each other
void open_lips(const std::vector<CrackedSurface>& surfaces);

}  // namespace contact
}  // namespace pellicle
