#pragma once

#include <optional>
#include <string>
#include <vector>

#include "options/choice.h"

namespace pellicle::ablation {

/// Rule for the death of springs at burnt triangles. surface: when all triangles that share them, or all at one of
/// their ends, are dead. triangles: when all that share them are dead, as in the paper.
enum class SpringRule { surface, triangles };
inline std::vector<std::string> names_of(SpringRule) { return {"surface", "triangles"}; }

/// Options of burning away and tearing (burning paper, sections 6 and 8.2).
struct AblationOptions {
  double loss_mass = 0;  ///< m^loss, as a fraction of the initial mass; 0: nothing burns away
  Choice<SpringRule> spring_rule = SpringRule::surface;
  double compact_fraction = 0.2;                 ///< fraction of dead cells at which these are removed; 1: never
  std::optional<double> strength;                ///< of the unburnt sheet, force per width [N/m]; none: nothing tears
  std::string strength_texture;                  ///< file of an image that weights the strength; none when empty
  std::vector<double> strength_range{0.2, 1.8};  ///< factors on the strength at black and at white
  double char_strength = 0.1;                    ///< fraction of the strength at the least mass
  double strength_length = 0.02;                 ///< length over which stress is averaged; 0: no average [m]
  double strength_scatter = 0;                   ///< largest random deviation of the strength, as a fraction
  double scatter_length = 0.02;                  ///< length over which the deviation varies [m]
  int seed = 1;                                  ///< of the scatter
  /// Prefix of PETSc's options for the solver that averages; in a run of several objects `objects_NAME_` stands before
  /// it.
  std::string solver_prefix = "ablation_";
};

/// Declares the options `ablation.*`. @param tears condition that anything can tear, which may depend on other options
void describe(OptionTable& table, AblationOptions& options, const Condition& tears);

}  // namespace pellicle::ablation
