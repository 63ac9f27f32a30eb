#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "base/incidence.h"
#include "elastic/sheet_geometry.h"
#include "surface/active_set.h"
#include "surface/membrane.h"
#include "surface/sheet.h"

namespace pellicle::elastic {

/// Curvature of a sheet at its corners, from a quadratic surface through each corner and the other corners of the cells
/// round it.
///
/// In coordinates r of the undeformed tangent plane (warp, weft) the heights of the neighbours above the corner are
/// fitted by g.r + r.B r / 2 with least squares, weighted by |r|^-4. B is linear in the heights, B_k = sum_i w_ki
/// n.(x_i
/// - x_0), so that a tilt changes nothing and a quadratic surface is fitted exactly, on any mesh. At an edge of the
/// sheet the points lie on one side and do not tell a curvature across the edge from a tilt: such parts of B are left
/// out, as no moment acts there, and the others are found as everywhere. So is twist at a single cell. At a clamped
/// edge the tangent plane is fixed, and only B is fitted.
///
/// A stencil has the cells whose two triangles at the corner live, if these are all of the cells round it or a fan.
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
    std::size_t first_cell = 0;
    std::size_t last_cell = 0;
    bool is_clamped = false;               ///< whether the normal stays that of the undeformed sheet
    double area = 0;                       ///< fraction of the sheet's area; 0: the stencil is not used [m^2]
    Curvature3 rest = Curvature3::Zero();  ///< B of the undeformed sheet [1/m]
  };

  /// The sheet must outlive the stencils. @param warp direction as for warp_of
  /// @param clamped local particles at which an edge keeps its tangent plane
  BendingStencils(const Sheet& sheet, const Eigen::Vector3d& warp, const std::vector<bool>& clamped);

  /// Adapts the stencils to burnt triangles. Not collective.
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
  /// Calls `take` with the lattice points of the cells of a stencil.
  template <class Take>
  void visit_lattice(const Stencil& stencil, const Take& take) const {
    for (std::size_t c = stencil.first_cell; c < stencil.last_cell; ++c) {
      if (counts_[c]) {
        take(sheet_->lattice[cells_[c].number]);
      }
    }
  }
  /// Calls `take` for each cell of a stencil with the triangle of the centre and the corners after and before it, which
  /// give the normal.
  template <class Take>
  void visit_triangles(const Stencil& stencil, const Take& take) const {
    for (std::size_t c = stencil.first_cell; c < stencil.last_cell; ++c) {
      if (counts_[c]) {
        const std::array<PetscInt, 4>& corners = sheet_->cells[cells_[c].number];
        const PetscInt k = cells_[c].corner;
        take(std::array<PetscInt, 3>{stencil.centre, corners[(k + 1) % 4], corners[(k + 3) % 4]});
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
  /// A cell at a stencil's centre.
  struct CellAt {
    PetscInt number = 0;
    PetscInt corner = 0;  ///< number of the centre among its corners
    /// The local number of the triangle at the k-th of its sides, counted from the centre.
    PetscInt triangle(PetscInt k) const { return 4 * number + (corner + k) % 4; }
  };
  /// The cells of a point of a stencil, by their numbers in the stencil: one of them must take part. A corner that lies
  /// opposite of the centre needs one of its two triangles, too.
  struct Support {
    std::array<std::size_t, 2> cells{};
    bool is_opposite = false;
  };

  void add_corner(PetscInt corner, Incidence::Range cells, bool is_clamped);
  bool find_part(const Stencil& stencil, const ActiveSet& active, std::vector<bool>& takes_part,
                 std::vector<bool>& counts) const;
  void fit(Stencil& stencil);

  const Sheet* sheet_;
  Eigen::Matrix3Xd warp_;
  std::vector<double> cell_area_;  ///< of the local cells [m^2]
  std::vector<Stencil> stencils_;
  std::vector<PetscInt> points_;
  std::vector<Curvature3> weights_;
  std::vector<Support> support_;  ///< of the points; unused for centres
  std::vector<CellAt> cells_;     ///< round the centres
  std::vector<bool> counts_;      ///< whether each of these cells took part in the last fit
  std::vector<bool> takes_part_;  ///< whether each point took part in the last fit
  std::vector<bool> active_before_;
  std::size_t fits_ = 0;
};

}  // namespace pellicle::elastic
