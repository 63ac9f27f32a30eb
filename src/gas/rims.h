#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle::gas {

/// The rims of chambers' walls with holes: closed loops of sides of active triangles without a neighbour. A cap closes
/// each rim: triangles from the mean of its sides to the sides. So a wall with holes encloses a volume. A pressure acts
/// on the existing wall, not on the caps.
///
/// Sides in a symmetry plane are not rims: the mirror image continues there. A rim that ends in planes is a part of a
/// loop, whose middle lies in them.
class Rims {
 public:
  /// No rims.
  Rims() = default;
  /// Finds the rims. Collective. The surface must outlive them. @param chamber of each local triangle, -1: none
  /// @param origin a point of all planes, about which volumes are taken; without planes any point [m]
  Rims(const Surface& surface, const std::vector<int>& chamber, const Eigen::Vector3d& origin,
       const SymmetryPlanes& planes);

  bool empty() const { return rims_.empty(); }
  /// A cap that closes a rim.
  struct Cap {
    int chamber;
    Eigen::Vector3d middle;  ///< [m]
    Eigen::Vector3d area;    ///< outwards [m^2]
    double volume;           ///< that it adds to the chamber [m^3]
  };
  /// The cap of each rim. Collective.
  std::vector<Cap> caps(const Field& positions) const;
  /// A hole that a cap closes.
  struct Hole {
    int chamber;
    double area;             ///< of the cap [m^2]
    Eigen::Vector3d middle;  ///< [m]
  };
  /// The holes of all ranks, the same on every rank. Collective.
  std::vector<Hole> holes(const Field& positions) const;
  /// Sides of local triangles on rims: 3 times the triangle plus the corner at which the side begins.
  const std::vector<PetscInt>& sides() const { return sides_of_triangles_; }
  /// Adds forces of `thrust` [Pa] times the area of each cap, from outside, shared out among the vertices of its rim,
  /// (3 x owned) [N]. Collective. @param thrust of each chamber
  void add_thrust(const Eigen::VectorXd& thrust, const Field& positions, Eigen::Matrix3Xd& force) const;

 private:
  struct Side {
    std::array<PetscInt, 2> ends{};  ///< local particles, in the order of the wall's triangle
    std::size_t rim = 0;
  };
  struct Rim {
    int chamber = -1;
    double sides = 0;                                         ///< how many
    Eigen::Matrix3d projector = Eigen::Matrix3d::Identity();  ///< on the symmetry planes in which the rim ends
  };

  const Surface* surface_ = nullptr;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::vector<Rim> rims_;
  std::vector<PetscInt> sides_of_triangles_;
  std::vector<Side> sides_;  ///< with an owned end
};

}  // namespace pellicle::gas
