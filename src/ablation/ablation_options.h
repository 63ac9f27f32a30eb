#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/choice.h"

namespace pellicle {
inline namespace base {
struct Condition;
class OptionTable;
}  // namespace base
inline namespace ablation {

/// When springs die where triangles have burnt away. surface: with all triangles that share them, or all at one of
/// their ends. triangles: with all that share them, as in the paper.
enum class SpringRule { surface, triangles };
inline const std::vector<std::string>& names_of(SpringRule) {
  static const std::vector<std::string> names{"surface", "triangles"};
  return names;
}

/// How a sheet burns away and tears (burning paper, sections 6 and 8.2).
struct AblationOptions {
  double loss_mass = 0;  ///< m^loss, as a fraction of the initial mass; 0: nothing burns away
  Choice<SpringRule> spring_rule = SpringRule::surface;
  double compact_fraction = 0.2;   ///< share of the cells that may be gone before they are removed; 1: never
  std::optional<double> strength;  ///< of the unburnt sheet, force per width [N/m]; none: nothing tears
  std::string strength_texture;    ///< file of an image that weights the strength; none when empty
  std::vector<double> strength_range{0.2, 1.8};  ///< factors on the strength at black and at white
  double char_strength = 0.1;                    ///< share of the strength that is left at the least mass
  double strength_length = 0.02;                 ///< over which stress is averaged; 0: not [m]
  double strength_scatter = 0;                   ///< largest share by which the strength differs at random
  double scatter_length = 0.02;                  ///< over which it does [m]
  int seed = 1;                                  ///< of the scatter
  /// Prefix of PETSc's options for the solver that averages; in a run of several objects `objects_NAME_` stands before
  /// it.
  std::string solver_prefix = "ablation_";
};

/// Declares the options `ablation.*`. @param tears whether anything can tear, for which there may be other options
void describe(OptionTable& table, AblationOptions& options, const Condition& tears);

}  // namespace ablation
}  // namespace pellicle
