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

/// Tearing by stress, which the burning paper leaves out (section 8.2): the sheet cracks along sides of its cells where
/// its tension exceeds the strength of what is left of it.
///
/// Springs of several colours share a load, and colours that cannot all keep their lengths push and pull against each
/// other, so the force F of a single spring says little. The stress of a cell does [N/m]:
///
///     sigma = 1/A sum F l^init d d^T
///
/// over the springs of its particles, where d is the direction of a spring, half of which belongs to each of its ends,
/// A the undeformed area of what is left of the cell, and the living quarters of cells share their corners; what
/// springs do to each other cancels. A side between two cells can crack when the largest principal stress
///
///     sigma_1 > strength c (1 + scatter u) t
///
/// of the mean stress of both, whatever the direction of the mesh, t the mean of the texture at both ends, u in [-1, 1)
/// a random number of seed and the cells' ids, and c the mean over both ends of
/// c^char + (1 - c^char) (m/m^init - m^min) / (1 - m^min). Where it cracks is told by the stress across the side,
/// n . sigma n with the normal n of the side in its cells, over the strength: of the sides that can crack and meet at a
/// corner, or are of one cell, only the one with the largest such ratio does in a step, and none with less than a
/// quarter of sigma_1 across it. What the others then carry shows in the next step.
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

  /// Sides that crack: the owned blue springs along them. Sides of what has burnt do not, nor those between two pinned
  /// particles. Collective.
  std::vector<PetscInt> cracks(const TearingInput& input);

 private:
  void find_stress(const TearingInput& input);
  double overload(const TearingInput& input, std::size_t side) const;

  const Sheet& sheet_;
  double char_strength_;
  std::vector<double> unburnt_strength_;  ///< force per width that each owned blue spring's side withstands [N/m]
  Field particle_sums_;                   ///< of F l^init d d^T, (3 x 3) in columns [N m]; living cells
  std::vector<Eigen::Matrix3d> stress_;   ///< of each local cell [N/m]
  Field overload_;                        ///< stress across each local side over its strength, 0 where it cannot crack
  Field largest_overload_;  ///< of the sides at each local corner, and of each local cell at its lattice point
};

}  // namespace ablation
}  // namespace pellicle
