#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "base/incidence.h"
#include "elastic/sheet_springs.h"
#include "surface/active_set.h"
#include "surface/membrane.h"
#include "surface/sheet.h"

namespace pellicle::elastic {

/// Curvature of a sheet at its particles, from a quadratic surface through each particle and its neighbours along red,
/// green and blue springs.
///
/// In coordinates r of the undeformed tangent plane (warp, weft) the heights of the neighbours above the particle are
/// fitted by g.r + r.B r / 2 with least squares. B is linear in the heights, B_k = sum_i w_ki n.(x_i - x_0), so that a
/// tilt changes nothing and a quadratic surface is fitted exactly, on any mesh. Lattice points have such a stencil as
/// long as the four triangles of their cell live. A corner's stencil has the cells round it whose two triangles at the
/// corner live, if these are all or a fan of at least two that determines the surface: without stencils at edges and
/// cracks a strip of a cell's width could fold without energy. At a clamped edge the tangent plane is fixed, and only B
/// is fitted.
///
/// The object holds the stencils of this rank's particles, and other stencils that contain these.
class BendingStencils {
 public:
  /// B11, B12, B22.
  using Curvature3 = Eigen::Array3d;

  struct Stencil {
    PetscInt centre = 0;    ///< local particle
    std::size_t first = 0;  ///< first point, the centre
    std::size_t last = 0;   ///< one past the last point
    std::size_t first_triangle = 0;
    std::size_t last_triangle = 0;
    bool is_clamped = false;               ///< whether the normal stays that of the undeformed sheet
    bool is_determined = true;             ///< whether the points determine the surface
    double area = 0;                       ///< fraction of the sheet's area; 0: the stencil is not used [m^2]
    Curvature3 rest = Curvature3::Zero();  ///< B of the undeformed sheet [1/m]
  };

  /// The sheet must outlive the stencils. @param warp direction as for warp_of
  /// @param clamped local particles at which an edge keeps its tangent plane
  BendingStencils(const Sheet& sheet, const Eigen::Vector3d& warp, const std::vector<bool>& clamped);

  /// Adapts the stencils to burnt triangles and cracks. Not collective.
  void update(const ActiveSet& active);

  const std::vector<Stencil>& stencils() const { return stencils_; }
  /// Local particles of all stencils.
  const std::vector<PetscInt>& points() const { return points_; }
  /// w_k of each point; their sum over a stencil is 0 [1/m^2].
  const std::vector<Curvature3>& weights() const { return weights_; }
  /// Whether a point of a stencil takes part in the fit; its weights are 0 if not.
  bool takes_part(std::size_t point) const { return takes_part_[point]; }
  /// Number of fits so far; weights do not change while this number does not.
  std::size_t fits() const { return fits_; }
  /// Calls `take` with the corners of each of the surface triangles round a centre that give its normal.
  template <class Take>
  void visit_triangles(const Stencil& stencil, const Take& take) const {
    for (std::size_t t = stencil.first_triangle; t < stencil.last_triangle; ++t) {
      if (counts_[t]) {
        take(sheet_->triangles[triangles_[t]]);
      }
    }
  }

  /// Sum of the areas times normals of the triangles round a centre, doubled; of the undeformed sheet at a clamp [m^2].
  /// @param positions of the local particles, (3 x local) [m]
  Eigen::Vector3d area_vector(const Stencil& stencil, const double* positions) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    visit_triangles(stencil, [&](const std::array<PetscInt, 3>& triangle) {
      const auto [e12, e13] = edges_of(stencil.is_clamped ? sheet_->rest.data() : positions, triangle);
      sum += e12.cross(e13);
    });
    return sum;
  }

 private:
  /// Condition for a point of a stencil to take part. For a lattice point beside a cell or a corner: two triangles,
  /// both of which must live, or -1; beside a cell the side between them must not have cracked. For a neighbour of a
  /// corner: the numbers in the stencil of the one or two lattice points beside it, one of which must take part.
  using Support = std::array<PetscInt, 2>;

  void add_lattice(PetscInt cell, const std::vector<PetscInt>& beyond);
  void add_corner(PetscInt corner, Incidence::Range cells, bool is_clamped);
  void begin_stencil(PetscInt centre);
  void add_point(PetscInt particle, Support support);
  void add_triangle(PetscInt triangle);
  bool find_part(const Stencil& stencil, const ActiveSet& active, std::vector<bool>& takes_part) const;
  void fit(Stencil& stencil);

  const Sheet* sheet_;
  Eigen::Matrix3Xd warp_;
  std::vector<double> cell_area_;  ///< of the local cells [m^2]
  std::vector<Stencil> stencils_;
  std::vector<PetscInt> points_;
  std::vector<Curvature3> weights_;
  std::vector<Support> support_;
  std::vector<PetscInt> triangles_;  ///< numbers of the surface triangles round the centres
  std::vector<bool> counts_;         ///< whether each of these triangles took part in the last fit
  std::vector<bool> takes_part_;     ///< whether each point took part in the last fit
  std::vector<bool> active_before_;
  std::vector<bool> cracked_before_;
  std::size_t fits_ = 0;
};

}  // namespace pellicle::elastic
