#pragma once

#include <string>

#include "tests/support/tight_projection.h"

namespace pellicle {

/// A small strip that is held at one end and pulled at the other until it tears here and there, in 30 steps. Four
/// frames.
inline const std::string tearing_scene = R"(
mesh: {shape: rectangle, cells: [8, 16], size: [0.4 m, 0.8 m]}
sheet: {thickness: 2 cm, areal_density: 1 kg/m^2, perturbation: 0.01}
time: {step: 1 ms, end: 30 ms}
force: {gravity: [0, 0, 0], damping: 5}
pins:
  lower: {box: [-1, -1, -1, 1, -0.39, 1]}
  upper: {box: [-1, 0.39, -1, 1, 1, 1], velocity: [0, 0.4 m/s, 0.1 m/s]}
heat: {initial_temperature: 300 K, ksp_rtol: 1e-12}
ablation: {strength: 100 N/m, strength_scatter: 0.3}
)" + tight_projection + "  interval_steps: 10\n";

}  // namespace pellicle
