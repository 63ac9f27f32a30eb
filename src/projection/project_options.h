#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "options/choice.h"
#include "surface/sheet.h"

namespace pellicle::projection {

/// Inverse masses of J W J^T: those of the particles, or ones.
enum class GramMasses { actual, equal };
inline std::vector<std::string> names_of(GramMasses) { return {"true", "equal"}; }

/// Treatment of pinned particles in J W J^T. exact: they have inverse mass 0; paper: they are like others.
enum class GramPins { exact, paper };
inline std::vector<std::string> names_of(GramPins) { return {"exact", "paper"}; }

/// Whether the colours are projected one after the other, or all springs at once.
enum class ProjectMethod { successive, joint };
inline std::vector<std::string> names_of(ProjectMethod) { return {"successive", "joint"}; }

enum class GramFormat { lines, aij, sell, shell };
inline std::vector<std::string> names_of(GramFormat) { return {"lines", "aij", "sell", "shell"}; }

/// A permutation of the colours, called "RGBY", "RGYB", ..., "YBGR".
enum class ColourOrder {};
std::vector<std::string> names_of(ColourOrder);
/// The colours in the order of a permutation.
std::array<Colour, 4> colours_of(const Choice<ColourOrder>& order);

/// Successive fast projection (burning paper, section 7).
struct ProjectOptions {
  /// Prefix of PETSc's options for these solvers; in a run of several objects `objects_NAME_` stands before it.
  std::string solver_prefix = "project_";
  Choice<ProjectMethod> method = ProjectMethod::successive;
  int max_steps = 7;        ///< full projection steps, each of the four colours in turn
  double threshold = 1e-7;  ///< of ||C|| over all springs [m]
  double error_limit = 1;   ///< of ||C|| / ||l||, beyond which the projection has failed
  Choice<ColourOrder> order = ColourOrder{};
  Choice<GramMasses> masses = GramMasses::actual;
  Choice<GramPins> pins = GramPins::exact;
  double shift = 1e-2;
  std::array<double, 4> weight{1, 1, 1, 1};  ///< w of each colour, eq. 19
  std::string weight_texture;                ///< a PNG whose brightness multiplies the weights of the springs
  Choice<GramFormat> mat_type = GramFormat::lines;
  double ksp_rtol = 1e-3;
  std::optional<double> strain_limit;  ///< of the weave's springs at the end of a step
  int strain_steps = 20;               ///< further projection steps for the strain limit, at most
  bool monitor = false;
};

void describe(OptionTable& table, ProjectOptions& options);
/// Declares the option of the strain limit alone, which elastic sheets have, too.
void describe_strain_limit(OptionTable& table, ProjectOptions& options);

}  // namespace pellicle::projection
