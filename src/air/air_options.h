#pragma once

#include "options/options.h"

namespace pellicle::air {

/// Motion of the air.
struct WindOptions {
  Rows velocity;          ///< time [s], x, y, z [m/s]; none: still air
  double turbulence = 0;  ///< rms of each component of the fluctuations, as a fraction of the speed
  double length = 0.2;    ///< integral length of the fluctuations [m]
  int seed = 1;           ///< of the fluctuations
};

/// The air round a sheet or a balloon.
struct AirOptions {
  double density = 0;    ///< [kg/m^3]; 0: no air
  double drag = 1;       ///< C_n of AirDrag
  double skin_drag = 0;  ///< C_t
  WindOptions wind;
};

void describe(OptionTable& table, AirOptions& options);

}  // namespace pellicle::air
