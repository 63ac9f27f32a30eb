#pragma once

#include <vector>

#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle::surface {

/// A distributed quad sheet: the body-centred-square shell of section 3.2.
///
/// Particles are the corner points (the mesh's vertices), then one lattice point a cell, at the mean of its corners
/// plus the thickness along the cell's normal. Local numbers: owned corners, owned lattice points, ghosts. Persistent
/// ids: the vertex number in the file, or first_lattice_id + the cell number in the file; copies of corners at cracks
/// have later ids.
struct Sheet : Surface {
  /// 2: the shell; 1: a net whose lattice points are at the mean of their cells' corners, without springs that act
  /// (follow_corners). Its springs other than the blue ones only connect pieces and conduct heat.
  int layers = 2;
  PetscInt owned_corners = 0;     ///< particles [0, owned_corners) are corners; up to `particles.owned` lattice points
  PetscInt first_lattice_id = 0;  ///< persistent id of the lattice point of the file's first cell

  /// Whether the springs of a colour act.
  bool acts(Colour colour) const { return layers == 2 || colour == Colour::blue; }
};

/// Mass that moves with each local particle of a sheet of one layer [kg]: for a corner its own and its fractions of the
/// lattice points round it, which the remaining corners of a cell share; 0 for lattice points. Collective.
/// @param mass ghosts up to date, (1 x local) [kg]
std::vector<double> corner_masses(const Sheet& sheet, const Field& mass);

/// Sets values at the lattice points of a sheet of one layer to the mean of their cells' corners. Not collective.
/// @param values (3 x local), ghosts up to date before and after
void follow_corners(const Sheet& sheet, Field& values);

/// Moves the removed corners of quads that still have a triangle along with the rest of their quads, because the centre
/// of a quad is drawn, and touches others, at the mean of its four corners. Of all rotations with translation and
/// scaling, one takes the quad's remaining particles from their undeformed places nearest to where they are (S.
/// Umeyama, 1991): the removed corner goes where that one takes it, to the mean if it belongs to several such quads.
/// Collective.
/// @param active the drawn triangles that remain, ghosts up to date @param mass of the particles, 0 of removed ones,
/// ghosts up to date, (1 x local) [kg] @param pinned local particles that stay in any case
/// @param position (3 x local), ghosts up to date before and after [m]
/// @param carried becomes whether each local particle has been moved
void carry_removed_corners(const Sheet& sheet, const std::vector<bool>& active, const Field& mass,
                           const std::vector<bool>& pinned, Field& position, std::vector<bool>& carried);

}  // namespace pellicle::surface
