#pragma once

#include <array>
#include <vector>

#include "elastic/elastic_options.h"
#include "surface/active_set.h"
#include "surface/sheet.h"

namespace pellicle::elastic {

/// Factors of the particles on the stiffness of a sheet, ghosts included.
struct MaterialFactors {
  std::vector<double> tensile;  ///< on the tensile stiffness, or empty for 1
  std::vector<double> shear;
  std::vector<double> bending;
};

/// The surface triangle beyond each side of each local cell, at 4 cell + side; -1: none.
std::vector<PetscInt> sides_beyond(const Sheet& sheet);

/// Undeformed areas of the local cells [m^2].
std::vector<double> cell_areas(const Sheet& sheet);

/// Direction of the warp at each local particle, in its tangent plane, (3 x local).
/// @param direction of the warp; it need not be a unit vector or lie in the surface
Eigen::Matrix3Xd warp_of(const Sheet& sheet, const Eigen::Vector3d& direction);

/// Stiffness of each local spring by colour [N/m], so that the net has given tensile and shear stiffness.
///
/// With the lattice points between their corners the springs are a centred rectangular net: blue and green ones along
/// the sides, red ones along the diagonals of the cells. Strained evenly, it has per area the energy
///
///     K_n1 e11^2 / 2 + K_n2 e22^2 / 2 + sum over both diagonals of K_d e_d^2 / 2,
///
/// so C12 = C66 = G, the shear stiffness (Cauchy's relation), and the tensile stiffnesses are C11 - G^2/C22 and C22 -
/// G^2/C11. A blue or green spring has the area of the surface triangles at its side, a red one half of its triangles'.
/// No green spring crosses an edge or a crack: its fraction goes to the blue springs beside it. Yellow springs have no
/// stiffness in whole cells, where they would resist a fold along the other diagonal; in a damaged cell they hold
/// corners without other springs.
///
/// Active springs have the stiffness of their active triangles. Dead springs, and those of other ranks that end at no
/// particle of this rank, have none.
class SheetSprings {
 public:
  /// The sheet must outlive this object. @param warp direction as for warp_of
  SheetSprings(const Sheet& sheet, const Stiffness& stiffness, const Eigen::Vector3d& warp,
               const MaterialFactors& factors);

  /// Largest ratio, over this rank's springs, of the stiffness along a side to the given one: 1, or more where the
  /// diagonals of long cells alone are stiffer.
  double largest_excess() const { return largest_excess_; }

  /// Stiffness of the local springs by colour [N/m]. Not collective.
  const std::array<std::vector<double>, 4>& stiffness(const ActiveSet& active);

 private:
  /// Stiffness of each spring over its area [N/m^3].
  std::array<std::vector<double>, 4> per_area_;
  const Sheet* sheet_;
  std::vector<double> cell_area_;  ///< of the local cells [m^2]
  std::vector<PetscInt> beyond_;   ///< sides_beyond
  double largest_excess_ = 1;
  std::vector<bool> active_before_;
  std::vector<bool> cracked_before_;
  std::array<std::vector<double>, 4> stiffness_;
};

}  // namespace pellicle::elastic
