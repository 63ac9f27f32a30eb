#pragma once

#include "projection/project_options.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace projection {

/// Refuses what the paper's projection may diverge on: particles with more than six neighbours by springs of one colour
/// (burning paper, section 8.2), unless `project.shift` is at least 1e-3, which keeps J J^T regular. A net becomes
/// singular where its springs form triangles, as yellow ones may, so that it has as many springs as its particles have
/// coordinates, or more. Collective.
/// @throws Error on all ranks, which names the vertex with most neighbours, of several that with the least persistent
/// id
void require_shift_at_irregular_vertices(const Sheet& sheet, const ProjectOptions& options);

}  // namespace projection
}  // namespace pellicle
