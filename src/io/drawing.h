#pragma once

#include <vtkSmartPointer.h>

#include <array>
#include <string>
#include <vector>

#include "mesh/membrane.h"
#include "mesh/sheet.h"

class vtkPolyData;

namespace pellicle {

/// A field to draw: `components` doubles for each local item, ghosts included.
struct DrawnField {
  std::string name;
  int components = 1;
  const double* values = nullptr;  ///< (components x local), must outlive the call that writes it
};

/// What a rank draws of a sheet or membrane, and from which of its items each drawn point and cell has its values.
/// A point is a particle, or the mean of the four corners of a cell.
struct Drawing {
  vtkSmartPointer<vtkPolyData> skeleton;           ///< all that does not change from frame to frame
  std::vector<PetscInt> particles;                 ///< of the first points
  std::vector<std::array<PetscInt, 4>> centre_of;  ///< of the points after them: the particles of which it is the mean
  std::vector<PetscInt> items;  ///< of each drawn cell: the local cell, the element, or the line itself
};

/// Four triangles a cell, round a virtual centre at the mean of its corners (burning paper, section 3.2). Points: the
/// corners that the rank's own cells use, then their centres. Point data: `vertex_id` (the persistent id), `uv` as
/// texture coordinates if the sheet has them, and `vtkGhostType`, which marks a corner that another rank owns as a
/// duplicate, so that statistics count it once. Cell data: `rank`, `cell_id`. Collective.
Drawing drawing_of(const Sheet& sheet);

/// The owned triangles as they are. Point and cell data as for a sheet; `cell_id` is the number of the face in its
/// file. Collective.
Drawing drawing_of(const Membrane& membrane);

/// The owned springs as lines between the particles themselves, corners and lattice points, the colours in their order:
/// point data `vertex_id` and `vtkGhostType`; cell data `colour` (as Colour) and `rank`.
Drawing drawing_of_springs(const Sheet& sheet);

/// The drawing with its points in place and with fields: of a point its particle's value, or the mean of the corners';
/// of a cell its item's.
/// @param positions of the local particles [m], (3 x local)
vtkSmartPointer<vtkPolyData> drawn(const Drawing& drawing, const double* positions,
                                   const std::vector<DrawnField>& particle_fields,
                                   const std::vector<DrawnField>& cell_fields);

}  // namespace pellicle
