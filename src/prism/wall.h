#pragma once

#include <vector>

#include "mesh/membrane.h"
#include "prism/material.h"
#include "prism/metric_energy.h"

namespace pellicle {

/// What the wall of a balloon is made of, element by element.
struct Wall {
  ThicknessRule rule = ThicknessRule::incompressible;
  bool preserve_volume = false;      ///< after each step, by Algorithm 2: the paper's way, with ThicknessRule::fixed
  std::vector<Material> materials;
  std::vector<int> material;         ///< of each local element
  std::vector<double> density;       ///< undeformed, of each local element [kg/m^3]
  std::vector<double> thickness;     ///< undeformed, of each local element [m]
  std::vector<RestMetric> rest;      ///< of each local element
};

/// Mass of each owned vertex: a third of its elements' (balloon paper, eq. 19, w = 1/3). [kg]
std::vector<double> vertex_masses(const Membrane& membrane, const Wall& wall);

}  // namespace pellicle
