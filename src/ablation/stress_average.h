#pragma once

#include <string>
#include <vector>

#include "heat/conduction.h"
#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/surface.h"

namespace pellicle::ablation {

/// Averages tension over a length of the undeformed surface, so that the load at which a singular stress makes the
/// surface crack, at the corner of a clamp or at the tip of a crack, does not depend on the mesh.
///
/// The average <s> solves <s> - lambda^2 Laplacian <s> = s on the active surface, so that nothing passes through cracks
/// and holes. Its maximum lies a part of lambda ahead of the tip of a crack. With the tension itself as weight,
///
///     s_average = <s^2> / <s>
///
/// is finite and largest at the tip, and proportional to the stress intensity K of a crack much longer than lambda. l
/// is the length for which it is K / sqrt(pi l). The mesh averages as well, over a length proportional to the size of
/// its elements: lambda is proportional to the remainder of l, which is 0 on large elements.
class StressAverage {
 public:
  /// @param surface with masses (set_burnable); it must outlive this object. Collective.
  /// @param length l [m]
  /// @param solver_prefix of PETSc's options
  StressAverage(const Surface& surface, double length, const std::string& solver_prefix);

  /// Averages over elements. Collective.
  /// @param tension s of the local elements, not below 0
  /// @returns s_average of the local elements; 0 of those that have burnt
  /// @throws Error if the solver fails
  std::vector<double> of(const std::vector<double>& tension, const ActiveSet& active);

  /// The length l over which the largest elements of all ranks average by themselves [m].
  double least_length() const { return least_length_; }

 private:
  const Surface& surface_;
  Field own_length_;  ///< over which the elements round each local particle average by themselves [m]
  double least_length_;
  Conduction conduction_;       ///< its step of 1 s averages
  Field rest_;                  ///< undeformed positions [m]
  Field mass_;                  ///< undeformed, the weight of a place [kg]
  Field tension_;               ///< s, then <s>
  Field square_;                ///< s^2, then <s^2>
  std::vector<double> weight_;  ///< of the local particles: active mass round them
};

}  // namespace pellicle::ablation
