#pragma once

#include <vector>

#include "parallel/field.h"
#include "surface/sheet.h"

namespace pellicle::surface {

// A sheet of one layer (Sheet::layers): its corners move, and the lattice points are the centres of their cells.

/// Mass that moves with each local particle [kg]: for a corner its own and its fractions of the lattice points round
/// it, which the remaining corners of a cell share; 0 for lattice points. Collective.
/// @param mass ghosts up to date, (1 x local) [kg]
std::vector<double> corner_masses(const Sheet& sheet, const Field& mass);

/// Sets values at lattice points to the mean of their cells' corners. Not collective.
/// @param values (3 x local), ghosts up to date before and after
void follow_corners(const Sheet& sheet, Field& values);

}  // namespace pellicle::surface
