#pragma once

#include <string>

namespace pellicle {

/// A small strip that is constrained at one end and pulled at the other until it cracks here and there and comes apart,
/// in 50 steps. Six frames.
inline const std::string tearing_scene = R"(
dynamics: elastic
mesh: {shape: rectangle, cells: [8, 16], size: [0.4 m, 0.8 m]}
sheet: {areal_density: 0.1 kg/m^2, tensile_stiffness: 5 kN/m, shear_stiffness: 1.9 kN/m, bending_stiffness: 1e-3 N m,
        damping: 5 ms, perturbation: 0}
elastic: {newton_tolerance: 1e-8}
time: {step: 1 ms, end: 50 ms}
force: {gravity: [0, 0, 0], damping: 0}
pins:
  lower: {box: [-1, -1, -1, 1, -0.39, 1]}
  upper: {box: [-1, 0.39, -1, 1, 1, 1], velocity: [0, 0.5 m/s, 0]}
heat: {initial_temperature: 300 K, ksp_rtol: 1e-12}
ablation: {strength: 100 N/m, strength_scatter: 0.15}
output:
  directory: out
  name: scene
  interval_steps: 10
)";

}  // namespace pellicle
