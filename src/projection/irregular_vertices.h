#pragma once

#include "projection/project_options.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace projection {

/// Refuses meshes on which the paper's projection may diverge: particles with more than six neighbours by springs of
/// one colour (burning paper, section 8.2), unless `project.shift` is at least 1e-3, which keeps J J^T regular. The
/// system becomes singular where springs form triangles, as yellow ones may, so that there are at least as many springs
/// as coordinates of their particles. Collective.
/// @throws Error on all ranks, which names the vertex with most neighbours, among several that with the least
/// persistent id
void require_shift_at_irregular_vertices(const Sheet& sheet, const ProjectOptions& options);

}  // namespace projection
}  // namespace pellicle
