#pragma once

#include <vector>

#include "parallel/field.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace surface {

// A sheet of one layer (Sheet::layers): its corners move, and the lattice points are the centres of their cells.

/// The mass that moves with each local particle [kg]: of a corner its own together with its shares of the lattice
/// points round it; a lattice point is shared by those corners of its cell that have not been removed; 0 for lattice
/// points. Collective.
/// @param mass ghosts up to date, (1 x local) [kg]
std::vector<double> corner_masses(const Sheet& sheet, const Field& mass);

/// Gives the lattice points the mean of their cells' corners. Not collective.
/// @param values (3 x local), ghosts up to date before and after
void follow_corners(const Sheet& sheet, Field& values);

}  // namespace surface
}  // namespace pellicle
