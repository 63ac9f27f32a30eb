#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::contact {

/// Triangles on points: first the particles, then the centres of quads, each at the mean of four particles.
struct TangledMesh {
  std::vector<Eigen::Vector3d> particles;            ///< [m]
  std::vector<bool> constrained;                     ///< particles that stay where they are
  std::vector<std::array<int, 4>> centres;           ///< particles of each centre
  std::vector<std::array<int, 3>> triangles;         ///< numbers of points: particles first, then centres
  double touch = 0;                                  ///< distance up to which triangles touch [m]
  std::vector<Eigen::Vector3d> points() const;       ///< places of particles and centres
  std::array<int, 4> particles_of(int point) const;  ///< the four of a centre; four times a particle itself
};

/// Moves the particles until no two triangles without a common point cut through each other, by at most a tenth of the
/// mean side in each sweep: an edge that cuts through a triangle moves in the direction in which the line along which
/// their surfaces cut becomes shorter fastest (Volino and Magnenat-Thalmann 2006, "Resolving surface collisions through
/// intersection contour minimization"), and its neighbours move partly with it. Where 1000 sweeps do not free two
/// pieces of each other, such as a strip straight through a sheet, the sweeps begin anew with the smaller piece without
/// constrained particles moved beside the others, as a whole, by the shortest way along an axis. Not collective.
///
/// Before that, of two triangles that touch (triangles_touch) the one of the greater number moves along the normal of
/// the other, and that against it, by a hundredth of the mean side in a sweep, until none does or 10 sweeps are over.
/// @returns how many edges still cut through triangles in the end; whether any touch again is not known
int untangle(TangledMesh& mesh);

}  // namespace pellicle::contact
