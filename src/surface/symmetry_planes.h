#pragma once

#include <Eigen/Core>
#include <vector>

namespace pellicle {
inline namespace surface {

/// Planes of symmetry with a common point, and the particles of a surface in them.
struct SymmetryPlanes {
  std::vector<Eigen::Vector3d> normals;  ///< unit vectors, 32 at most
  /// For each local particle bit k is set if it lies in plane k; empty without planes.
  std::vector<unsigned> of_particle;

  /// Bits of the planes in which two particles both lie. Not collective.
  unsigned common(PetscInt a, PetscInt b) const { return of_particle.empty() ? 0 : of_particle[a] & of_particle[b]; }
};

}  // namespace surface
}  // namespace pellicle
