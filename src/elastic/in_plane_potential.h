#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "elastic/elastic_options.h"
#include "energies/cell_terms.h"
#include "energies/potential.h"
#include "surface/active_set.h"
#include "surface/sheet.h"

namespace pellicle::elastic {

/// Factors of the particles on the stiffness of a sheet, ghosts included.
struct MaterialFactors {
  std::vector<double> tensile;  ///< on the tensile stiffness, or empty for 1
  std::vector<double> shear;
  std::vector<double> bending;
};

/// Energy of a sheet that is strained in its plane: St. Venant and Kirchhoff's law in plane stress, orthotropic by warp
/// and weft.
///
/// The mean strain m of a cell, Green's as a vector (E11, E22, sqrt(2) E12) by axes along warp and weft, is that of the
/// lines between the middles of its opposite sides. Four triangles, each between a side and the mean of the corners,
/// have strains e_t and areas A_t, if they are left. The energy of a cell is
///
///     U = A m.C m / 2 + sum_t A_t c |e_t - m|^2 / 2,  A = sum_t A_t,
///
/// where C is the material's stiffness and c a third of its least eigenvalue. So an even strain has the energy of the
/// material on any mesh. Only the mean strain of a cell meets the whole stiffness, c keeps the other strains of its
/// triangles in order: a cell does not lock where the warp is oblique to its sides or where it bends, as a
/// quadrilateral with one point of integration (Flanagan and Belytschko, A uniform strain hexahedron and quadrilateral
/// with orthogonal hourglass control, Int. J. Numer. Meth. Eng. 17, 1981).
///
/// The lattice point, which has mass, is tied to the mean of the corners with a stiffness tie |x_l - mean|^2 / 2, tie =
/// (C11 + C22)/2. Where two triangles at a corner have burnt, the lattice point itself is the third corner of those
/// that are left.
///
/// Strains are measured from a shape that has shrunk by the mean of both layers in each triangle. Viscosity resists the
/// change of strain since the step's start with the same stiffness times damping_over_step.
///
/// U is quadratic in the squared lengths of the six edges between the corners, sides and diagonals, by which everything
/// is computed. The positive Hessian leaves out compressive principal stresses. No communication.
class InPlanePotential : public Potential {
 public:
  /// The sheet must outlive this object. @param warp direction as for warp_of
  InPlanePotential(const Sheet& sheet, const Stiffness& stiffness, const Eigen::Vector3d& warp,
                   const MaterialFactors& factors);

  /// What a step changes, of the local particles.
  struct Input {
    const std::vector<double>& shrinkage;  ///< length over undeformed length
    const std::vector<double>& factor;     ///< on the stiffness, such as of char
    double damping_over_step = 0;          ///< viscosity over stiffness and length of the step
  };
  /// Sets shape and stiffness of a step that starts at `start`.
  void begin_step(const ActiveSet& active, const Field& start, const Input& input);

  /// This rank's fractions of the energy without viscosity, and of the viscous term in the value, half of the work
  /// against viscosity [J].
  double elastic_energy(const Field& x) const;
  double viscous_energy(const Field& x) const { return value(x) - elastic_energy(x); }
  /// Stress of each local cell, viscosity included, a force per present width [N/m]; 0 where nothing is left.
  std::vector<Eigen::Matrix3d> stress(const Field& x) const;

  double value(const Field& x) const override;
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override { add_value_and_gradient(x, gradient); }
  double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  void update_hessian(const Field& x, double psd_blend) override;
  void add_hessian(const HessianBlocks& blocks) const override;
  bool has_terms() const override { return true; }
  void visit(HessianTerms& terms) const override { terms.add_cells(hessian_); }

 private:
  static constexpr std::size_t edges = CellTerms::edges;
  using OfEdges = Eigen::Matrix<double, edges, 1>;
  /// Strain or stress as (11, 22, sqrt(2) 12).
  using Mandel = Eigen::Vector3d;
  /// The derivative of a triangle's strain by the squared lengths of the edges of its cell [1/m^2].
  using StrainBySquares = Eigen::Matrix<double, 3, edges>;

  struct Cell {
    OfEdges rest;                               ///< squared lengths of the undeformed edges [m^2]
    std::array<StrainBySquares, 5> by_squares;  ///< of the triangles, and m
    std::array<double, 4> undeformed_area{};    ///< of the triangles [m^2]
    Eigen::Matrix3d stiffness;                  ///< C [N/m]
    double least = 0;                           ///< c [N/m]
    // In the present step.
    double factor = 0;                      ///< on the stiffness
    std::array<double, 5> area{};           ///< undeformed, of the triangles that are left, and all of it [m^2]
    std::array<double, 5> squared_scale{};  ///< of lengths
    OfEdges start;                          ///< squared lengths of the edges at the start [m^2]
  };
  /// Stresses of a cell that belong to the strains of its triangles and to m [N/m], and its energy [J].
  struct State {
    std::array<Mandel, 5> stress;
    double energy = 0;
  };

  double mean(std::size_t cell, const std::vector<double>& values) const;
  template <class StrainOf>
  static State state_of(const Cell& cell, const StrainOf& strain_of);
  State elastic_state(const Cell& cell, const OfEdges& squares) const;
  State state(const Cell& cell, const OfEdges& squares) const;
  static OfEdges by_squares(const Cell& cell, const std::array<Mandel, 5>& stress);
  void set_coupling(std::size_t number);

  const Sheet& sheet_;
  std::vector<Cell> cells_;  ///< local
  double viscosity_ = 0;     ///< damping_over_step
  std::vector<CellTerms> hessian_;
};

}  // namespace pellicle::elastic
