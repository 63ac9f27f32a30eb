#pragma once

#include <Eigen/Core>
#include <vector>

#include "geometry/projectors.h"
#include "parallel/layout.h"
#include "surface/membrane.h"

namespace pellicle::prism {

/// Second derivatives or a curvature tensor of a surface in two axes: entries 11, 12, 22.
using PlateCurvature = Eigen::Vector3d;

/// A vertex of a wall with its neighbours, by which the curvature of the surface is measured.
///
/// The neighbours' heights above the undeformed tangent plane are fitted by the quadratic g.r + r.b r/2 through the
/// vertex, with least squares (as Cazals and Pouget 2005, Estimating differential quantities using polynomial fitting
/// of osculating jets). b is linear in the heights, b_k = sum_p w_pk n.x_p, so that a tilt changes nothing and a
/// quadratic surface is fitted exactly on any mesh. With the deformed positions and normal n the same sum is the second
/// fundamental form in undeformed coordinates.
///
/// Fewer than five neighbours do not determine the curvature: if these surround a vertex, the points across the sides
/// between them are added.
///
/// The normal is along N = sum x_p x x_q over the sides (p, q) of a polygon: of the neighbours, or if these do not
/// surround the vertex of the vertex and the neighbours.
struct PlateStencil {
  PetscInt centre = 0;            ///< vertex
  Eigen::Index first = 0;         ///< first point: the vertex, followed by its neighbours, in order round it
  Eigen::Index ring_end = 0;      ///< one past the neighbours
  Eigen::Index last = 0;          ///< one past the points beyond the neighbours, which follow
  bool is_closed = true;          ///< whether neighbours surround the vertex
  bool has_fixed_normal = false;  ///< keeps the undeformed normal: clamped edge, or two symmetry planes
  /// Normal of a plane of symmetry in which an edge of the mesh lies, zero if there is none: the surface continues
  /// beyond as its mirror image.
  Eigen::Vector3d mirror = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< undeformed
  PlateCurvature rest = PlateCurvature::Zero();       ///< of the undeformed surface [1/m]
  /// |N| undeformed, over |N| of the same triangles laid flat.
  double flatness = 1;
};

/// A triangle at the vertex of a stencil.
struct PlateCorner {
  PetscInt element = 0;  ///< local
  Eigen::Matrix2d
      inverse;  ///< of the undeformed edges to the next vertex and the one before, in the stencil's axes [1/m]
};

/// The stencils of a wall, at the vertices that have one: those that triangles surround, if their points determine the
/// curvature (do not all lie on a conic through the vertex), and at the wall's edge those that are clamped or in a
/// plane of symmetry perpendicular to the wall. Other edges are free of moments.
struct PlateStencils {
  /// The vertices of the membrane, with further vertices of stencils that contain vertices of this rank as additional
  /// ghosts.
  Layout reach;
  bool goes_beyond = false;             ///< whether any rank has such further ghosts
  std::vector<PlateStencil> stencils;   ///< of owned vertices, then of others with an owned vertex among their points
  std::size_t owned = 0;                ///< stencils of owned vertices
  std::vector<PetscInt> points;         ///< of all stencils: vertices of `reach`
  std::vector<PlateCurvature> weights;  ///< w of each point; their sum over a stencil is 0 [1/m^2]
  std::vector<std::vector<PlateCorner>> corners;  ///< the triangles round the vertex of each owned stencil
};

/// Collective. The membrane must outlive the stencils.
/// @param projectors on the directions in which each local vertex may move
/// @param clamped local vertices that keep their tangent plane at an edge
PlateStencils plate_stencils(const Membrane& membrane, const Projectors& projectors, const std::vector<bool>& clamped);

}  // namespace pellicle::prism
