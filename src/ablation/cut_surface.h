#pragma once

#include <vector>

#include "surface/drawn_surface.h"
#include "surface/living.h"

namespace pellicle {

/// The living triangles of a rank's cells, cut where the level set is zero (marching triangles; burning paper, eq. 7
/// and Fig. 6). A corner stands for itself, a virtual centre is the mean of its cell's corners and has its lattice
/// particle's level and id. A cut point is linear between the two points that it lies between; its negative id depends
/// on their ids alone, and neighbours on other ranks compute the same point from the same numbers.
///
/// Points: corners that are used, then virtual centres, then cut points, each once. A point that several ranks draw is
/// owned by the one that draws the cell of the least id at it. Four triangles a cell where nothing is cut. Not
/// collective.
/// @param level of the local particles, ghosts up to date
DrawnSurface cut_surface(const Sheet& sheet, const Living& living, const std::vector<double>& level);

}  // namespace pellicle
