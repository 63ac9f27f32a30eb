#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "elastic/sheet_springs.h"
#include "surface/incidence.h"
#include "surface/living.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace elastic {

/// Curvature of a sheet at its particles, by a quadratic surface through each and its neighbours along red, green and
/// blue springs.
///
/// In coordinates r of the undeformed tangent plane (warp, weft) the heights of the neighbours above the particle
/// are fitted by g.r + r.B r / 2 with least squares. B is linear in the heights, B_k = sum_i w_ki n.(x_i - x_0), so
/// that a tilt changes nothing and a quadratic surface is met exactly, on any mesh. Lattice points have such a stencil
/// as long as the four triangles of their cell live. Corners have one of the cells round them of which both triangles
/// live, if these are all or a fan of at least two that determines the surface: without those at edges and cracks a
/// strip of a cell's width could fold back and forth for nothing. A corner at a clamped edge has one whose tangent
/// plane stays as it is: only B is fitted to the heights.
///
/// The object holds the stencils of this rank's particles, and those that reach them.
class BendingStencils {
 public:
  /// B11, B12, B22.
  using Curvature3 = Eigen::Array3d;

  struct Stencil {
    PetscInt centre = 0;    ///< local particle
    std::size_t first = 0;  ///< of its points; the centre is the first
    std::size_t last = 0;   ///< one past them
    std::size_t first_triangle = 0;
    std::size_t last_triangle = 0;
    bool is_clamped = false;               ///< the normal is that of the undeformed sheet, always
    bool is_determined = true;             ///< whether its points determine the surface
    double area = 0;                       ///< area that it stands for; 0: it is not used [m^2]
    Curvature3 rest = Curvature3::Zero();  ///< B of the undeformed sheet [1/m]
  };

  /// The sheet must outlive it.
  /// @param clamped local particles at which an edge keeps its tangent plane
  BendingStencils(const Sheet& sheet, const Weave& weave, const std::vector<bool>& clamped);

  /// Removes stencils of what has died. Not collective.
  void update(const Living& living);

  const std::vector<Stencil>& stencils() const { return stencils_; }
  /// Local particles of all stencils.
  const std::vector<PetscInt>& points() const { return points_; }
  /// w_k of each point; their sum over a stencil is 0 [1/m^2].
  const std::vector<Curvature3>& weights() const { return weights_; }
  /// Whether a point of a stencil does: its weights are 0 if not.
  bool takes_part(std::size_t point) const { return takes_part_[point]; }
  /// Number of times that weights were found: they are the same as long as this number is.
  std::size_t fits() const { return fits_; }
  /// Calls `take` with the corners of each of the drawn triangles round a centre that give its normal.
  template <class Take>
  void visit_triangles(const Stencil& stencil, const Take& take) const {
    for (std::size_t t = stencil.first_triangle; t < stencil.last_triangle; ++t) {
      if (counts_[t]) {
        take(sheet_->triangles[triangles_[t]]);
      }
    }
  }

  /// Sum of the areas times normals of the triangles round a centre, doubled [m^2].
  template <class Positions>
  Eigen::Vector3d area_vector(const Stencil& stencil, const Positions& x) const {
    return stencil.is_clamped ? sum_of_areas(stencil, sheet_->rest) : sum_of_areas(stencil, x);
  }

 private:
  template <class Positions>
  Eigen::Vector3d sum_of_areas(const Stencil& stencil, const Positions& x) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    visit_triangles(stencil, [&](const std::array<PetscInt, 3>& triangle) {
      const Eigen::Vector3d corner = x.col(triangle[0]);
      sum += (x.col(triangle[1]) - corner).cross(x.col(triangle[2]) - corner);
    });
    return sum;
  }

  /// What a point of a stencil depends on. Of a lattice point beside a cell or a corner: two triangles, of which both
  /// must live, or -1; and beside a cell the side between them must not have cracked. Of a neighbour of a corner: the
  /// numbers in the stencil of the one or two lattice points beside it, of which one must take part.
  using Support = std::array<PetscInt, 2>;

  void add_lattice(PetscInt cell, const std::vector<PetscInt>& beyond);
  void add_corner(PetscInt corner, Incidence::Range cells, bool is_clamped);
  void begin_stencil(PetscInt centre);
  void add_point(PetscInt particle, Support support);
  void end_stencil();
  bool find_part(const Stencil& stencil, const Living& living, std::vector<bool>& takes_part) const;
  void fit(Stencil& stencil);

  const Sheet* sheet_;
  Eigen::Matrix3Xd warp_;
  std::vector<double> cell_area_;  ///< of the local cells [m^2]
  std::vector<Stencil> stencils_;
  std::vector<PetscInt> points_;
  std::vector<Curvature3> weights_;
  std::vector<Support> support_;
  std::vector<PetscInt> triangles_;   ///< numbers of the drawn triangles round the centres
  std::vector<bool> counts_;          ///< of each of these, whether it does, since the last fit of its stencil
  std::vector<bool> takes_part_;      ///< of each point, likewise
  std::vector<PetscInt> stencil_of_;  ///< of each local particle, -1: none
  std::vector<bool> living_before_;
  std::vector<bool> cracked_before_;
  std::size_t fits_ = 0;
};

}  // namespace elastic
}  // namespace pellicle
