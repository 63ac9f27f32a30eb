#pragma once

#include "mesh/surface_mesh.h"

namespace pellicle {

/// Number of pairs of triangles that cut through each other (triangles_intersect); polygons are split into fans, and
/// triangles with a common point are left out. By a tree of bounding boxes.
int count_self_intersections(const SurfaceMesh& mesh);

}  // namespace pellicle
