#pragma once

#include <string>
#include <vector>

#include "mesh/field.h"
#include "mesh/sheet.h"

namespace pellicle {

/// A field to draw: `components` doubles for each local item, ghosts included.
struct DrawnField {
  std::string name;
  int components = 1;
  const double* values = nullptr;  ///< (components x local), must outlive the call that writes it
};

/// One moment of a sheet, as the simulation hands it to the writer.
struct Frame {
  double time = 0;  ///< [s]
  int step = 0;
  const double* positions = nullptr;                       ///< of the local particles [m], (3 x local), ghosts up to date
  std::vector<DrawnField> particle_fields;                 ///< on the local particles
  std::array<std::vector<DrawnField>, 4> spring_fields;    ///< on the local springs of each colour
};

}  // namespace pellicle
