#pragma once

#include <Eigen/Core>
#include <vector>

#include "energies/potential.h"

namespace pellicle {
inline namespace prism {

/// Interface of the stiffness K = d2U/dx2 of the local elements and of the pressure load on them, at given positions.
/// No communication.
class ElementStiffness {
 public:
  virtual ~ElementStiffness() = default;

  /// Evaluates the stiffness at positions with ghosts up to date.
  /// @param pressure on the local elements, whose load stiffness is included [Pa], or empty for none
  virtual void update(const Field& positions, const std::vector<double>& thickness_ratio,
                      const std::vector<double>& pressure) = 0;

  /// Adds factor K w to `result`, both (3 x local); ghosts get only a part of their sum.
  virtual void add_product(double factor, const double* w, double* result) const = 0;

  /// Adds factor times the blocks of K, nine for each local element: corners (0, 0), (0, 1), ..., (2, 2) [N/m].
  virtual void add_blocks(double factor, const HessianBlocks& blocks) const = 0;
};

}  // namespace prism
}  // namespace pellicle
