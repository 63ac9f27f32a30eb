#pragma once

#include <Eigen/Core>
#include <vector>

#include "ablation/ablation_options.h"
#include "parallel/field.h"
#include "surface/living.h"

namespace pellicle {
inline namespace ablation {

/// Share of the strength that is left at a particle of this mass (a fraction of the initial one, as m^min is): linear,
/// `char_strength` at m^min.
double share_of_strength(double mass_ratio, double min_mass, double char_strength);

/// What decides where a surface cracks.
struct CrackInput {
  const Living& living;
  const std::vector<Eigen::Matrix3d>& stress;  ///< of each local element, of the unit of the strength
  const Field& position;                       ///< [m], ghosts up to date
  const Field& mass;                           ///< [kg], ghosts up to date; positive at the corners of what lives
  const std::vector<bool>& pinned;             ///< local particles that nothing moves
  double min_mass = 0;                         ///< m^min as a fraction of the initial mass
};

/// Cracks along the sides of a surface's elements, for sheets as for walls.
///
/// Stress and strength are forces per width [N/m], or both stresses [Pa]. A side between two elements can crack when
/// the largest principal stress
///
///     sigma_1 > strength c (1 + scatter u) t
///
/// of the mean stress of both elements, whatever the direction of the mesh. Here t is the mean of the texture at both
/// ends, u in [-1, 1) a random number from the seed and the elements' ids, and c the mean over both ends of
/// c^char + (1 - c^char) (m/m^init - m^min) / (1 - m^min). Which of these sides cracks depends on the stress across the
/// side, n . sigma n with the normal n of the side in its elements, over the strength: of the sides that can crack and
/// meet at a corner, or belong to one element, only the one with the largest such ratio cracks in a step, and none with
/// less than a quarter of sigma_1 across it. The load that this puts on the others shows in the next step.
class Cracks {
 public:
  /// The surface must have masses and springs (set_burnable), and outlive this object. Collective.
  /// @param options with a strength
  /// @param texture factor on the strength of each local particle, or empty for 1
  Cracks(const Surface& surface, const AblationOptions& options, const std::vector<double>& texture);

  /// Sides that crack: the blue springs along them, each on one rank, where both elements are local. Sides of burnt
  /// elements do not crack, nor those between two pinned particles. Collective.
  std::vector<PetscInt> sides(const CrackInput& input);

 private:
  double overload(const CrackInput& input, std::size_t blue) const;
  bool is_counted_here(std::size_t blue) const;

  const Surface& surface_;
  double char_strength_;
  std::vector<double> unburnt_strength_;  ///< that each owned blue spring's side withstands
  Field overload_;                        ///< stress across each local side over its strength, 0 where it cannot crack
  Field largest_overload_;  ///< of the sides at each local corner, and of each local quad at its lattice point
};

}  // namespace ablation
}  // namespace pellicle
