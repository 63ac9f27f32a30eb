#pragma once

#include <array>
#include <vector>

#include "ablation/ablation_options.h"
#include "parallel/field.h"
#include "surface/living.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace ablation {

/// Share of the strength that is left of a particle of this mass, as a fraction of the initial one as m^min is: linear,
/// `char_strength` at m^min.
double share_of_strength(double mass_ratio, double min_mass, double char_strength);

/// What tearing needs to know of a step.
struct TearingInput {
  const Living& living;
  const std::array<std::vector<double>, 4>& force;  ///< of each owned spring by colour, positive where it pulls [N]
  const Field& position;                            ///< [m], ghosts up to date
  const Field& mass;                                ///< [kg], ghosts up to date; positive at the ends of living springs
  const std::vector<bool>& pinned;                  ///< local particles that nothing moves
  double min_mass = 0;                              ///< m^min as a fraction of the initial mass
};

/// Tearing by stress, which the burning paper leaves out (section 8.2): the sheet tears where its tension exceeds the
/// strength of what is left of it.
///
/// Springs of several colours share a load, and colours that cannot all keep their lengths push and pull against each
/// other, so the force F of a single spring says little. The stress of a cell does [N/m]:
///
///     sigma = 1/A sum F l^init d d^T
///
/// over the springs of its particles, where d is the direction of a spring, half of which belongs to each of its ends,
/// A the undeformed area of what is left of the cell, and the living quarters of cells share their corners; what
/// springs do to each other cancels. A spring tears when
///
///     d . sigma d > strength c (1 + scatter u) t
///
/// with the mean stress of the cells that it lies in, t the mean of the texture at both ends, u in [-1, 1) a random
/// number of seed and persistent ids, and c the mean over both ends of
/// c^char + (1 - c^char) (m/m^init - m^min) / (1 - m^min). Of the springs that meet at a particle only the one that
/// exceeds its strength by the largest factor tears in a step: what the others then carry shows in the next.
///
/// The stress of an elastic sheet is that of its material. That of a projected one is exact for a load, whatever the
/// step; of lengths which contradict each other, such as those of a shrinking sheet between clamps, it has no limit in
/// a sheet that cannot stretch: it is that of the springs which an unfinished projection amounts to, in proportion to
/// (edge/h)^2.
class Tearing {
 public:
  /// The sheet must outlive this object. Collective.
  /// @param options with a strength
  /// @param texture factor on the strength of each local particle, or empty for 1
  Tearing(const Sheet& sheet, const AblationOptions& options, const std::vector<double>& texture);

  /// Owned springs of each colour that tear; dead springs do not, nor those between two pinned particles. Collective.
  std::array<std::vector<PetscInt>, 4> torn(const TearingInput& input);

 private:
  void find_stress(const TearingInput& input);
  void find_overload(const TearingInput& input);

  const Sheet& sheet_;
  double char_strength_;
  std::array<std::vector<double>, 4> unburnt_strength_;  ///< force per width that each owned spring withstands [N/m]
  Field particle_sums_;                                  ///< of F l^init d d^T, (3 x 3) in columns [N m]; living cells
  std::vector<Eigen::Matrix3d> stress_;                  ///< of each local cell [N/m]
  std::array<Field, 4> overload_;  ///< stress along each local spring over its strength, 0 where it cannot tear
  Field largest_overload_;         ///< of the springs at each local particle
};

}  // namespace ablation
}  // namespace pellicle
