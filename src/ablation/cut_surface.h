#pragma once

#include <cstdint>
#include <vector>

#include "surface/active_set.h"
#include "surface/drawn_surface.h"

namespace pellicle::ablation {

/// The id of a cut point between particles of the ids a < b is -(a cut_id_stride + b) - 1. The stride is larger than
/// any id, and fixed, since cracks add ids.
inline constexpr std::int64_t cut_id_stride = std::int64_t{1} << 31;

/// The active triangles of a rank's elements, cut where the level set is zero (marching triangles; burning paper, eq. 7
/// and Fig. 6). The virtual centre of a quad is the mean of its corners and has its lattice particle's level and id. A
/// cut point lies between two points where the level, taken as linear, is zero; its negative id depends on their ids
/// alone, and other ranks compute the same point from the same numbers.
///
/// Points: corners that are used, then virtual centres, then cut points, each once. A point that several ranks draw is
/// owned by the one that draws the element of the least id at it. Uncut elements are drawn with all triangles.
/// Collective.
/// @param level of the local particles, ghosts up to date
DrawnSurface cut_surface(const Surface& surface, const ActiveSet& active, const std::vector<double>& level);

/// The largest value of a field at the points of cut_surface on all ranks; 0 without points. Collective.
/// @param values of the local particles, ghosts up to date, of both layers: a virtual centre has its lattice particle's
double largest_drawn(const Surface& surface, const ActiveSet& active, const std::vector<double>& level,
                     const double* values);

/// The whole surface, uncut. Collective.
DrawnSurface whole_surface(const Surface& surface);

}  // namespace pellicle::ablation
