#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <string>
#include <vector>

#include "geometry/solids.h"
#include "state/field_registry.h"
#include "surface/active_set.h"
#include "surface/drawn_surface.h"
#include "surface/sheet.h"

namespace pellicle::io {

/// A field to draw: `components` doubles for each local item, ghosts included.
struct DrawnField {
  std::string name;
  int components = 1;
  const double* values = nullptr;  ///< (components x local), must outlive the call that writes it
  /// Whether a particle field has the lattice particle's value at a cell's virtual centre, not the corners' mean.
  bool is_of_both_layers = false;
};

/// The fields of a state that frames show, on its particles or its cells.
std::vector<DrawnField> drawn_fields(const FieldRegistry& state, Item item);

/// A rank's drawing of a sheet or membrane, with the items from which each drawn point and cell has its values.
struct Drawing {
  vtkSmartPointer<vtkPolyData> skeleton;  ///< all but the places of the points and the fields
  std::vector<DrawnPoint> points;
  std::vector<PetscInt> items;  ///< of each drawn cell: the local cell, the element, or the owned spring
};

/// A drawing of the active part of a surface. Point data: `vertex_id` (the persistent id, negative at cuts), the
/// texture coordinates `TCoords`, of type float, if the surface has them, and `vtkGhostType`, which marks a point that
/// another rank counts as a duplicate, so that statistics count it once. Cell data: `rank`, and `cell_id`, the number
/// of the face in its file. Collective.
Drawing drawing_of(const Surface& surface, DrawnSurface drawn);

/// A drawing of the active owned springs as lines between particles, the colours in their order: point data `vertex_id`
/// and `vtkGhostType`; cell data `colour` (as Colour) and `rank`. An item is the number of the spring among the owned
/// ones of all colours, dead ones included.
Drawing drawing_of_springs(const Sheet& sheet, const ActiveSet& active);

/// The drawing with places of points and fields: a point has the weighted mean of its particles' values, a cell its
/// item's value.
/// @param positions of the local particles [m], (3 x local)
vtkSmartPointer<vtkPolyData> drawn(const Drawing& drawing, const double* positions,
                                   const std::vector<DrawnField>& particle_fields,
                                   const std::vector<DrawnField>& cell_fields);

/// The surface of a solid as triangles, for frames; of a half space a square round the origin of its frame. Fields:
/// `vertex_id` and `cell_id`, which do not change between frames.
/// @param half half of the square's edge [m]
vtkSmartPointer<vtkPolyData> drawing_of_solid(const Solid& solid, double half);

}  // namespace pellicle::io
