#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace gas {

/// The rims of what is left of the walls of chambers: closed loops of the sides of triangles that have no neighbour. A
/// cap closes each: triangles from the middle of its vertices to its sides, which move with it. So a wall with holes
/// encloses a volume. A pressure acts on what is there of the wall, not on the caps.
class Rims {
 public:
  /// There are none.
  Rims() = default;
  /// Collective. The surface must outlive the rims. @param chamber of each local triangle, -1: it bounds none
  Rims(const Surface& surface, const std::vector<int>& chamber);

  bool empty() const { return chamber_.empty(); }
  /// Adds what the caps enclose to the volumes of the chambers, about an origin [m^3]. Collective.
  void add_volumes(const Field& positions, const Eigen::Vector3d& origin, Eigen::VectorXd& volumes) const;
  /// What a cap closes.
  struct Hole {
    int chamber;
    double area;             ///< of the cap [m^2]
    Eigen::Vector3d middle;  ///< [m]
  };
  /// The same on every rank. Collective.
  std::vector<Hole> holes(const Field& positions) const;
  /// Their sides, of all local triangles: 3 times the triangle plus the corner where it begins.
  const std::vector<PetscInt>& sides() const { return sides_of_triangles_; }
  /// Adds forces of `thrust` [Pa] times the area of each cap, from outside, shared out among the vertices of its rim,
  /// (3 x owned) [N]. Collective. @param thrust of each chamber
  void add_thrust(const Eigen::VectorXd& thrust, const Field& positions, Eigen::Matrix3Xd& force) const;

 private:
  struct Side {
    std::array<PetscInt, 2> ends{};  ///< local particles, in the order of the wall's triangle
    std::size_t rim = 0;
  };
  struct Cap {
    Eigen::Vector3d middle;
    Eigen::Vector3d area;  ///< outwards [m^2]
  };

  std::vector<Cap> caps(const Field& positions) const;

  const Surface* surface_ = nullptr;
  std::vector<int> chamber_;      ///< of each rim
  std::vector<double> sides_of_;  ///< how many each has
  std::vector<PetscInt> sides_of_triangles_;
  std::vector<Side> sides_;  ///< with an owned end
};

}  // namespace gas
}  // namespace pellicle
