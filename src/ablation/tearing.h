#pragma once

#include <array>
#include <string>
#include <vector>

#include "ablation/ablation_options.h"
#include "ablation/cracks.h"
#include "parallel/field.h"
#include "surface/living.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace ablation {

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
/// and A the undeformed area of what is left of the cell; the living quarters of cells share their corners. In this sum
/// what springs do to each other cancels. For where the sheet then cracks see Cracks.
///
/// The stress of an elastic sheet is that of its material. That of a projected one is exact for a load, whatever the
/// step. With target lengths that contradict each other, such as those of a shrinking sheet between clamps, the stress
/// of a sheet that cannot stretch would be infinite: what is found is the stress of the springs which an unfinished
/// projection amounts to, in proportion to (edge/h)^2.
class Tearing {
 public:
  /// The sheet must outlive this object. Collective.
  /// @param options with a strength
  /// @param texture factor on the strength of each local particle, or empty for 1
  Tearing(const Sheet& sheet, const AblationOptions& options, const std::vector<double>& texture);

  /// Sides that crack (see Cracks): the owned blue springs along them. Collective.
  std::vector<PetscInt> cracks(const TearingInput& input);
  /// See Cracks::remark.
  std::string remark() const { return cracks_.remark(); }

 private:
  void find_stress(const TearingInput& input);

  const Sheet& sheet_;
  Cracks cracks_;
  Field particle_sums_;                  ///< of F l^init d d^T, (3 x 3) in columns [N m]; living cells
  std::vector<Eigen::Matrix3d> stress_;  ///< of each local cell [N/m]
};

}  // namespace ablation
}  // namespace pellicle
