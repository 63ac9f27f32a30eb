#pragma once

#include <array>
#include <vector>

#include "ablation/ablation_options.h"
#include "mesh/field.h"
#include "mesh/living.h"
#include "mesh/sheet.h"

namespace pellicle {

/// What tearing needs to know of a step.
struct TearingInput {
  const Living& living;
  /// How much shorter each owned spring's own constraint made it in the step, by colour; negative where longer [m].
  const std::array<std::vector<double>, 4>& pull;
  const Field& mass;                ///< [kg], ghosts up to date; positive at the ends of living springs
  const std::vector<bool>& pinned;  ///< local particles that nothing moves
  double h = 0;                     ///< length of the step [s]
  double min_mass = 0;              ///< m^min as a fraction of the initial mass
};

/// Tearing by stress, which the burning paper leaves out (section 8.2): a spring tears when the tension that the
/// projection needed to keep its length exceeds the strength of what is left of the sheet,
///
///     F = pull / (h^2 (1/m_a + 1/m_b)) > strength l^init c (1 + scatter u) t,
///
/// with 1/m = 0 for a pinned end. t is the mean of the texture at both ends, u in [-1, 1) a random number of seed and
/// persistent ids, and c the mean over both ends of c^char + (1 - c^char) (m/m^init - m^min) / (1 - m^min).
///
/// The load of a sheet is shared by the edges of its cells, the lattice layer and the diagonals: pulled along its edges
/// the most loaded springs carry 0.5 to 0.8 of the load on their width, so that a sheet begins to tear at 1.2 to 2
/// times its strength.
class Tearing {
 public:
  /// The sheet must outlive this object.
  /// @param options with a strength
  /// @param texture factor on the strength of each local particle, or empty for 1
  Tearing(const Sheet& sheet, const AblationOptions& options, const std::vector<double>& texture);

  /// Owned springs of each colour that tear; dead springs do not, nor those between two pinned particles. Not
  /// collective.
  std::array<std::vector<PetscInt>, 4> torn(const TearingInput& input) const;

 private:
  const Sheet& sheet_;
  double char_strength_;
  std::array<std::vector<double>, 4> unburnt_strength_;  ///< force that each owned spring withstands [N]
};

}  // namespace pellicle
