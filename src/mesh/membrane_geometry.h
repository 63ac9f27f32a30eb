#pragma once

#include <vector>

#include "mesh/membrane.h"

namespace pellicle {

/// Undeformed area round each local vertex: a third of the triangles that it belongs to [m^2]. Collective.
std::vector<double> vertex_areas(const Membrane& membrane);

}  // namespace pellicle
