#pragma once

#include <Eigen/Core>
#include <vector>

namespace pellicle {
inline namespace surface {

/// Planes of symmetry with a common point, and which particles of a surface lie in them.
struct SymmetryPlanes {
  std::vector<Eigen::Vector3d> normals;  ///< unit vectors, 32 at most
  /// Of each local particle: bit k says that it lies in plane k. Empty where there are no planes.
  std::vector<unsigned> of_particle;

  /// The planes that two particles lie in. Not collective.
  unsigned common(PetscInt a, PetscInt b) const { return of_particle.empty() ? 0 : of_particle[a] & of_particle[b]; }
};

}  // namespace surface
}  // namespace pellicle
