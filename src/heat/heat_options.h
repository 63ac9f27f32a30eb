#pragma once

#include <map>
#include <string>
#include <vector>

#include "heat/heat_source.h"
#include "options/choice.h"

namespace pellicle::heat {

/// Discrete Laplacian of the conduction. umbrella: eq. 3 as printed.
enum class HeatOperator { consistent, umbrella };
inline std::vector<std::string> names_of(HeatOperator) { return {"consistent", "umbrella"}; }

/// automatic: shell, unless the options of the solver ask for entries of the matrix.
enum class HeatMatrix { automatic, aij, shell };
inline std::vector<std::string> names_of(HeatMatrix) { return {"auto", "aij", "shell"}; }

/// Heat of a surface (burning paper, section 5).
struct HeatOptions {
  /// Prefix of PETSc's options for these solvers; in a run of several objects `objects_NAME_` stands before it.
  std::string solver_prefix = "heat_";
  double initial_temperature = 300;  ///< of every particle [K]
  Choice<HeatOperator> operator_name = HeatOperator::consistent;
  double diffusivity = 2e-3;        ///< alpha [m^2/s]
  std::string diffusivity_texture;  ///< file of an image that weights alpha by particle; none when empty
  std::vector<double> diffusivity_range{0.2, 1.8};  ///< factors on alpha at black and at white
  double burning_heat = 300;                        ///< eta: rise per unit of lost mass fraction [K]
  double capacity = 1340;                           ///< c [J/(kg K)]
  double ambient_temperature = 300;                 ///< [K]
  double convection = 0;                            ///< h_c, on each side [W/(m^2 K)]
  double emissivity = 0;                            ///< epsilon, on each side
  double ksp_rtol = 1e-8;                           ///< relative to the norm of the right-hand side
  Choice<HeatMatrix> mat_type = HeatMatrix::automatic;
  std::map<std::string, HeatSource> sources;  ///< by name
};

/// Declares the options `heat.*`, the objects `heat.sources` and the solver prefix `heat_`.
void describe(OptionTable& table, HeatOptions& options);

}  // namespace pellicle::heat
