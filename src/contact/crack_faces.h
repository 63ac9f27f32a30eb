#pragma once

#include <vector>

#include "contact/contact_surface.h"
#include "surface/split_corners.h"

namespace pellicle::contact {

/// Gap, as a fraction of the thickness, at which things that are in one place undeformed, such as the crack faces of a
/// crack, begin to press.
constexpr double lip_share = 0.05;

/// A corner that is split, or one of its copies, by persistent ids.
struct CrackFace {
  PetscInt of = 0;  ///< the corner that is split
  PetscInt id = 0;
  bool operator<(const CrackFace& other) const { return of != other.of ? of < other.of : id < other.id; }
  bool operator==(const CrackFace& other) const { return of == other.of && id == other.id; }
};

/// All crack faces of a surface on all ranks, sorted. Collective.
std::vector<CrackFace> find_crack_faces(const Surface& surface, const SplitCorners& corners);

/// A surface that may have cracked, one of those that touch each other.
struct CrackedSurface {
  ContactSurface::Part part;           ///< its surface has the split corners
  const std::vector<bool>* active;     ///< of its surface triangles; null: all of them
  std::vector<bool> constrained;       ///< local particles that stay where they are
  std::vector<CrackFace> crack_faces;  ///< of fresh cracks, from find_crack_faces
  Field& position;                     ///< ghosts up to date, before and after
};

/// Moves the crack faces of fresh cracks apart, since surfaces in one place have no side of each other on which they
/// could be kept. Each goes towards the middle of the active triangles round it by `lip_share` of the thickness, unless
/// these would then cut through those round another crack face of the same corner, as in a fold: then it goes in
/// another direction. The way is shorter where another part of the surface, or another surface, is near. Collective.
/// @param surfaces all that touch each other
void separate_crack_faces(const std::vector<CrackedSurface>& surfaces);

}  // namespace pellicle::contact
