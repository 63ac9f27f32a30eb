#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/sheet.h"

namespace pellicle::ablation {

/// Stress of the cells of a sheet, of which its springs are the material: by it a sheet of paper tears, which the
/// burning paper leaves out (section 8.2; see Cracks).
///
/// Springs of several colours share a load, and colours that cannot all keep their lengths push and pull against each
/// other, so the force F of a single spring says little. The stress of a cell does [N/m]:
///
///     sigma = 1/A sum F l^init d d^T
///
/// over the springs of its particles, where d is the direction of a spring, half of which belongs to each of its ends,
/// and A the undeformed area of what is left of the cell; the active quarters of cells share their corners. In this sum
/// what springs do to each other cancels.
///
/// The stress of an elastic sheet is that of its material. That of a projected one is exact for a load, whatever the
/// step. With target lengths that contradict each other, such as those of a shrinking sheet between clamps, the stress
/// of a sheet that cannot stretch would be infinite: what is found is the stress of the springs which an unfinished
/// projection amounts to, in proportion to (edge/h)^2.
class SpringStress {
 public:
  /// The sheet must outlive this object. Collective.
  explicit SpringStress(const Sheet& sheet);

  /// Stress of each local cell [N/m], kept until the next call. Collective.
  /// @param active what has not burnt @param force of each owned spring by colour, positive where it pulls [N]
  /// @param position [m], ghosts up to date
  const std::vector<Eigen::Matrix3d>& find(const ActiveSet& active, const std::array<std::vector<double>, 4>& force,
                                           const Field& position);

 private:
  const Sheet& sheet_;
  Field particle_sums_;                  ///< of F l^init d d^T, (3 x 3) in columns [N m]; active cells
  std::vector<Eigen::Matrix3d> stress_;  ///< of each local cell [N/m]
};

}  // namespace pellicle::ablation
