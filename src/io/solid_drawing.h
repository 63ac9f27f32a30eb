#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include "geometry/solids.h"

namespace pellicle {
inline namespace io {

/// The surface of a solid as triangles, for frames; of a half space a square round the origin of its frame. Fields:
/// `vertex_id` and `cell_id`, which do not change between frames.
/// @param half half of the square's edge [m]
vtkSmartPointer<vtkPolyData> drawing_of_solid(const Solid& solid, double half);

}  // namespace io
}  // namespace pellicle
