#pragma once

#include <Eigen/Core>
#include <map>
#include <string>

#include "combustion/combustion_options.h"
#include "contact/bodies.h"
#include "heat/heat_options.h"
#include "io/output_options.h"
#include "contact/pins.h"
#include "mesh/mesh_options.h"
#include "mesh/sheet_options.h"
#include "projection/project_options.h"
#include "projection/spring_baseline.h"

namespace pellicle {

/// The clock of a run.
struct TimeOptions {
  double step = 2e-3;   ///< h [s]
  double end = 1;       ///< [s]
  int max_steps = 0;    ///< 0: no limit
  int max_retries = 6;  ///< halvings of a failed step in succession
};

void describe(OptionTable& table, TimeOptions& options);

/// External force on the sheet.
struct ForceOptions {
  Eigen::Vector3d gravity{0, 0, -9.81};  ///< [m/s^2]
  double damping = 2;                    ///< of the velocities [1/s]
};

void describe(OptionTable& table, ForceOptions& options);

/// Everything that a deck can say.
struct Options {
  std::string dynamics = "projection";  ///< projection or spring
  MeshOptions mesh;
  SheetOptions sheet;
  TimeOptions time;
  HeatOptions heat;
  CombustionOptions combustion;
  ForceOptions force;
  ProjectOptions project;
  SpringOptions spring;
  std::map<std::string, BodyOptions> bodies;
  std::map<std::string, PinOptions> pins;
  OutputOptions output;
};

void describe(OptionTable& table, Options& options);

}  // namespace pellicle
