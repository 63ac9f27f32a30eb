#pragma once

#include <string>
#include <vector>

#include "tests/support/tight_projection.h"

namespace pellicle {

/// A deck with something of everything, small: a sheet of 20 x 20 cells that hangs by two corners, is lifted by a ball
/// and burns under a hot spot for 20 steps. Inner tolerances leave no noise for buckling to amplify. Two frames.
inline const std::string burning_scene = R"(
mesh: {shape: rectangle, cells: [20, 20], size: [1 m, 1 m]}
sheet: {thickness: 2.5 cm, areal_density: 1 kg/m^2, perturbation: 0.01}
time: {step: 2 ms, end: 40 ms}
force: {gravity: [0, 0, -1 m/s^2], damping: 2}
pins:
  hooks: {corners: [min_x_max_y, max_x_max_y]}
bodies:
  ball: {shape: sphere, centre: [0.1, 0, -0.21], radius: 0.2 m, velocity: [0, 0, 1 m/s], friction: 0.3}
heat:
  initial_temperature: 300 K
  diffusivity: 2e-3
  burning_heat: 300 K
  ksp_rtol: 1e-12
  sources:
    spot: {shape: ball, centre: [-0.3, 0, 0], velocity: [1 m/s, 0, 0], radius: 0.3 m, temperature: 1000 K, rate: 100}
combustion:
  ignition_temperature: 500 K
  mass_loss_rate: 0.05
  mass_loss_texture: )" PELLICLE_SOURCE_DIR R"(/input/textures/clouds.png
  mass_loss_range: [0.2, 1.8]
  min_mass: 0.3
  initial_density: 800
  burnt_density: 320
)" + tight_projection + "  interval_steps: 20\n";

/// Options that turn the scene into one of which a third burns away in 24 steps. Four frames.
inline const std::vector<std::string> burning_away{"-ablation_loss_mass",
                                                   "0.6",
                                                   "-combustion_mass_loss_rate",
                                                   "0.5",
                                                   "-heat_sources_spot_rate",
                                                   "500",
                                                   "-heat_sources_spot_radius",
                                                   "0.35 m",
                                                   "-heat_sources_spot_velocity",
                                                   "5,0,0",
                                                   "-heat_sources_spot_temperature",
                                                   "1200 K",
                                                   "-time_end",
                                                   "48 ms",
                                                   "-output_interval_steps",
                                                   "8",
                                                   "-project_max_steps",
                                                   "3"};

/// Options that turn it, together with these, into a small one of which half burns away in 24 steps, so that it falls
/// in two, compacted often.
inline const std::vector<std::string> falling_in_two{"-mesh_cells",
                                                     "14,14",
                                                     "-heat_sources_spot_velocity",
                                                     "15,0,0",
                                                     "-ablation_compact_fraction",
                                                     "0.05",
                                                     "-output_interval_steps",
                                                     "4"};

}  // namespace pellicle
