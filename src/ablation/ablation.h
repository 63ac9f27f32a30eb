#pragma once

#include <vector>

#include "ablation/ablation_options.h"
#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/sheet.h"

namespace pellicle::ablation {

/// Level set of burning, m'/m^init = m/m^init - m^loss of the local particles; where it is negative the surface has
/// burnt away (burning paper, section 6).
/// @param mass [kg], ghosts up to date, (1 x local)
/// @param loss_mass m^loss as a fraction of the initial mass
/// @param level a vector whose memory becomes the result's
std::vector<double> level_set(const Surface& surface, const Field& mass, double loss_mass,
                              std::vector<double> level = {});

/// The state of a spring, from the levels of its two ends (burning paper, section 6 and Fig. 5). A burnt spring is
/// removed when the triangles that share it are gone.
enum class SpringState { shrunk = 0, partly_burnt = 1, burnt = 2 };
SpringState spring_state(double level_0, double level_1);

// Removal of burnt triangles and springs from a surface, and cracks, without renumbering.
//
// A surface triangle dies when all three of its points have burnt (m' < 0), the virtual centre of a quad with the
// lattice particle's m'. A spring dies when all triangles that share it are dead, a green one also when the side that
// it crosses cracks, and by SpringRule::surface also when all triangles at one of its ends are dead.

/// Removes the triangles and springs that die by the level set. Collective.
/// @returns whether a triangle died on any rank
bool burn_away(const Surface& surface, SpringRule rule, ActiveSet& active, const std::vector<double>& level);

/// Cracks sides of elements. Nothing is removed from the surface. Collective.
/// @param sides owned blue springs along these sides, each between two local elements
/// @returns whether any rank has such a side
bool crack(const Surface& surface, SpringRule rule, ActiveSet& active, const std::vector<PetscInt>& sides);

/// Updates springs, and triangles and sides of other ranks' elements, from those of the owned ones. Collective.
void follow_triangles(const Surface& surface, SpringRule rule, ActiveSet& active);

/// Whether each local particle has an active triangle; others neither conduct heat nor cool. Collective.
std::vector<bool> particles_with_surface(const Surface& surface, const ActiveSet& active);

/// Owned particles whose last spring is dead and that still have a mass. Not collective.
std::vector<PetscInt> bare_particles(const Surface& surface, const ActiveSet& active, const Field& mass);

/// Whether each owned cell is empty: no active springs, except blue ones, which neighbours may share. Not collective.
std::vector<bool> empty_cells(const Sheet& sheet, const ActiveSet& active);

}  // namespace pellicle::ablation
