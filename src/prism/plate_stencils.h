#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "geometry/projectors.h"
#include "parallel/layout.h"
#include "surface/membrane.h"

namespace pellicle {
inline namespace prism {

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
  std::size_t first = 0;          ///< first point: the vertex, followed by its neighbours, in order round it
  std::size_t ring_end = 0;       ///< one past the neighbours
  std::size_t last = 0;           ///< one past the points beyond the neighbours, which follow
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
class PlateStencils {
 public:
  /// Collective. The membrane must outlive the stencils.
  /// @param projectors on the directions in which each local vertex may move
  /// @param clamped local vertices that keep their tangent plane at an edge
  PlateStencils(const Membrane& membrane, const Projectors& projectors, const std::vector<bool>& clamped);

  /// The vertices of the membrane, with further vertices of stencils that contain vertices of this rank as additional
  /// ghosts.
  const Layout& reach() const { return reach_; }
  /// Whether any rank has such further ghosts.
  bool goes_beyond() const { return goes_beyond_; }
  /// The stencils of owned vertices, then those of other vertices with an owned vertex among their points.
  const std::vector<PlateStencil>& stencils() const { return stencils_; }
  /// Number of stencils of owned vertices.
  std::size_t owned() const { return owned_; }
  /// Points of all stencils: vertices of reach().
  const std::vector<PetscInt>& points() const { return points_; }
  /// w of each point; their sum over a stencil is 0 [1/m^2].
  const std::vector<PlateCurvature>& weights() const { return weights_; }
  /// The triangles round the vertex of stencil s, one of the owned, are the corners from corner_offsets()[s].
  const std::vector<PlateCorner>& corners() const { return corners_; }
  const std::vector<std::size_t>& corner_offsets() const { return corner_offsets_; }

 private:
  /// A triangle at a vertex: its two other vertices, in the triangle's sense, by global numbers.
  struct Wedge {
    PetscInt next;
    PetscInt previous;
    PetscInt element;  ///< local, or -1
  };
  /// The points of a stencil by global numbers.
  struct Fan {
    PetscInt centre = 0;
    std::vector<PetscInt> ring;
    std::vector<PetscInt> beyond;
    bool is_closed = true;
  };
  static Fan fan_of(std::vector<Wedge> wedges);
  std::vector<Fan> fans(const Membrane& membrane, std::vector<std::vector<Wedge>>& wedges);
  bool add(const Fan& fan, const Eigen::Matrix3d& projector, bool is_clamped, const Eigen::Matrix3Xd& rest);
  void add_corners(const PlateStencil& stencil, const std::vector<Wedge>& wedges, const Eigen::Matrix3Xd& rest);
  PetscInt number(PetscInt global) const;
  bool fit(PlateStencil& stencil, const Eigen::Matrix3Xd& rest);

  Layout reach_;
  bool goes_beyond_ = false;
  std::map<PetscInt, PetscInt> ghosts_;  ///< local number in `reach_` of each global ghost
  std::vector<PlateStencil> stencils_;
  std::size_t owned_ = 0;
  std::vector<PetscInt> points_;
  std::vector<PlateCurvature> weights_;
  std::vector<PlateCorner> corners_;
  std::vector<std::size_t> corner_offsets_{0};
  Eigen::Matrix<double, 3, 2> axes_;  ///< of the stencil that was fitted last
};

}  // namespace prism
}  // namespace pellicle
