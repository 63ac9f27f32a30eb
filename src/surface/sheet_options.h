#pragma once

#include <string>
#include <vector>

#include "options/choice.h"

namespace pellicle::surface {

enum class Partitioner { metis, ptscotch, simple };
inline std::vector<std::string> names_of(Partitioner) { return {"metis", "ptscotch", "simple"}; }

/// Options of making a distributed shell from a mesh.
struct SheetOptions {
  int layers = 2;               ///< Sheet::layers
  double thickness = 2.5e-3;    ///< offset of the lattice points along the normal [m]
  double areal_density = 0.08;  ///< [kg/m^2]
  bool is_one_surface = false;  ///< lattice points lie between their corners, not `thickness` above
  Choice<Partitioner> partitioner = Partitioner::metis;
  double perturbation = 0;       ///< amplitude of the initial noise, as a fraction of the mean cell edge
  int seed = 1;                  ///< of the initial noise
  double imbalance_limit = 1.1;  ///< cells of a rank over the mean above which the surface is distributed anew
};

void describe(OptionTable& table, SheetOptions& options);

}  // namespace pellicle::surface
