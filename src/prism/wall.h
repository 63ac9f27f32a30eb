#pragma once

#include <vector>

#include "prism/material.h"
#include "prism/metric_energy.h"
#include "prism/prism_options.h"
#include "surface/membrane.h"

namespace pellicle::prism {

/// Materials and undeformed geometry of a balloon's wall, element by element.
struct Wall {
  ThicknessRule rule = ThicknessRule::incompressible;
  bool preserve_volume = false;  ///< after each step by Algorithm 2, as in the paper, with ThicknessRule::fixed
  std::vector<Material> materials;
  std::vector<int> material;      ///< of each local element
  std::vector<double> density;    ///< undeformed, of each local element [kg/m^3]
  std::vector<double> thickness;  ///< undeformed, of each local element [m]
  std::vector<RestMetric> rest;   ///< of each local element

  const Material& material_of(std::size_t element) const { return materials[material[element]]; }
};

/// Makes the wall that the options describe. Materials: the wall's, then one for each region. Every law works with
/// every rule, since each has a thickness free of stress even without lambda (neo-Hookean, Ogden: the undeformed one).
/// Collective.
/// @param texture in [0, 1] of each local element, if `wall.thickness_texture` gives the thickness; else empty
/// @throws Error that names the key, and the element by its persistent id: a thickness that is not positive, an unknown
/// field, two sources of thickness, a region that selects nothing, regions that overlap, constants that exclude each
/// other or make no stable material (the undeformed state needs positive shear and bulk moduli)
Wall make_wall(const Membrane& membrane, const WallOptions& options, const std::vector<double>& texture);

/// Mass of each owned vertex: a third of its elements' (balloon paper, eq. 19, w = 1/3). [kg]
std::vector<double> vertex_masses(const Membrane& membrane, const Wall& wall);

}  // namespace pellicle::prism
