#pragma once

#include <Eigen/Core>
#include <vector>

#include "solvers/potential.h"

namespace pellicle {
inline namespace prism {

/// The stiffness K = d2U/dx2 of the local elements at some positions and that of the pressure load on them, in one of
/// several ways. Nothing here communicates.
class ElementStiffness {
 public:
  virtual ~ElementStiffness() = default;

  /// Takes the values at these positions, ghosts up to date.
  /// @param pressure of the local elements, whose load stiffness counts [Pa], or empty for none
  virtual void update(const Field& positions, const std::vector<double>& thickness_ratio,
                      const std::vector<double>& pressure) = 0;

  /// Adds factor K w to `result`, both (3 x local); ghosts get only a part of their sum.
  virtual void add_product(double factor, const double* w, double* result) const = 0;

  /// Adds factor times the blocks of K, nine for each local element: corners (0, 0), (0, 1), ..., (2, 2) [N/m].
  virtual void add_blocks(double factor, const HessianBlocks& blocks) const = 0;
};

}  // namespace prism
}  // namespace pellicle
