#pragma once

#include <string>

namespace pellicle {

class OptionTable;

/// How a mesh becomes a distributed shell.
struct SheetOptions {
  double thickness = 2.5e-3;    ///< offset of the lattice points along the normal [m]
  double areal_density = 0.08;  ///< [kg/m^2]
  std::string partitioner = "metis";
  double perturbation = 0;       ///< amplitude of the initial noise, as a share of the mean cell edge
  int seed = 1;                  ///< of the initial noise
  double imbalance_limit = 1.2;  ///< largest number of cells of a rank over the mean that a compaction leaves as it is
};

void describe(OptionTable& table, SheetOptions& options);

}  // namespace pellicle
