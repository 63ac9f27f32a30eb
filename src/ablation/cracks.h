#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "ablation/ablation_options.h"
#include "ablation/stress_average.h"
#include "parallel/field.h"
#include "surface/active_set.h"

namespace pellicle::ablation {

/// Data of a step for cracks.
struct CrackInput {
  const ActiveSet& active;
  const std::vector<Eigen::Matrix3d>& stress;  ///< of each local element, in the unit of the strength
  const Field& position;                       ///< [m], ghosts up to date
  const Field& mass;                           ///< [kg], ghosts up to date; positive at corners of active elements
  const std::vector<bool>& pinned;             ///< local particles that are pinned
  double min_mass = 0;                         ///< m^min as a fraction of the initial mass
};

/// Cracks along the sides of a surface's elements, for sheets as for walls.
///
/// Stress and strength are forces per width [N/m], or both stresses [Pa]. A side between two elements can crack when
/// the largest principal stress
///
///     sigma_1 > strength c (1 + scatter u) t
///
/// of the mean stress of both elements, whatever the direction of the mesh, and when the average of sigma_1 over the
/// length `strength_length` (StressAverage), the mean of both elements, exceeds the same. Here t is the mean of the
/// texture at both ends and c the mean over both ends of c^char + (1 - c^char) (m/m^init - m^min) / (1 - m^min).
///
/// u is the least value that a random field takes in both elements. The field follows from the seed and the undeformed
/// place and varies over the length `scatter_length` (noise): so elements larger than this length are as weak as the
/// weakest of their places, and a surface is as strong on any mesh.
///
/// Of the sides that can crack and meet at a corner, or belong to one element, only one cracks in a step: that with the
/// largest stress across it, n . sigma n with the normal n of the side in its elements, over its strength (here with
/// the mean of both elements' u). A side with less than a quarter of sigma_1 across it does not crack. The next step
/// has the load that the crack puts on the other sides.
class Cracks {
 public:
  /// The surface must have masses and springs (set_burnable), and outlive this object. Collective.
  /// @param options with a strength
  /// @param texture factor on the strength of each local particle, or empty for 1
  Cracks(const Surface& surface, const AblationOptions& options, const std::vector<double>& texture);

  /// Sides that crack: the blue springs along them, each on one rank, where both elements are local. Sides of burnt
  /// elements do not crack, nor those between two pinned particles. Collective. @throws Error as StressAverage does
  std::vector<PetscInt> sides(const CrackInput& input);

  /// Remark if elements are so large that the load at which they crack depends on the mesh; else empty.
  std::string remark() const;

 private:
  struct Strength {
    double weakest;  ///< of all places in both elements
    double mean;     ///< of the elements
  };
  Strength strength(const CrackInput& input, std::size_t blue) const;
  double overload(const CrackInput& input, std::size_t blue) const;
  void require_average_overload(const CrackInput& input);
  bool is_counted_here(std::size_t blue) const;

  const Surface& surface_;
  AblationOptions options_;
  std::vector<double> texture_;           ///< of the local particles, or empty
  std::vector<double> element_strength_;  ///< of each local element, unburnt and without texture
  std::optional<StressAverage> average_;  ///< if there is a length over which to average
  Field overload_;                        ///< stress across each local side over its strength, 0 where it cannot crack
  Field largest_overload_;  ///< of the sides at each local corner, and of each local quad at its lattice point
};

}  // namespace pellicle::ablation
