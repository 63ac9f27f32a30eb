#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/surface.h"

namespace pellicle::heat {

/// Diffusion between pairs of particles: capacity_i dT_i/dt = sum_j weight_ij (T_j - T_i), a symmetric graph Laplacian.
struct DiffusionGraph {
  /// Local particle numbers; a pair may occur more than once, then its weights add up. Every pair with an owned
  /// particle is here, so that owned rows are complete without communication.
  std::vector<std::array<PetscInt, 2>> pairs;
  std::vector<double> weights;  ///< one a pair
  Eigen::VectorXd capacity;     ///< of the owned particles

  /// Sets `sum`, (local), to sum_j weight_ij (T_j - T_i) of the owned particles; its values for ghosts are only parts
  /// of their sums. Not collective. @param values ghosts up to date, (1 x local)
  void add_up_inflow(const Field& values, Eigen::VectorXd& sum) const;
};

/// Pairs of the umbrella: the springs of all four colours, or the edges of triangles.
std::vector<std::array<PetscInt, 2>> umbrella_pairs(const Surface& surface);

/// Sets weights and capacity to the scale-dependent umbrella as printed (burning paper, eq. 3, acting on T), row i
/// times E_i/2 so that it is symmetric: weight_ij = alpha_ij / d_ij with the present distance, not below 1e-3 of the
/// initial length, and the mean alpha of both ends; capacity_i = E_i/2 with E_i = sum_j d_ij. Dead springs are left
/// out.
/// @param diffusivity alpha of the local particles [m^2/s]
/// @param positions [m], ghosts up to date, (3 x local)
/// @param active springs that have not burnt, ghosts up to date
void set_umbrella(DiffusionGraph& graph, const Surface& surface, const std::vector<double>& diffusivity,
                  const Field& positions, const ActiveSet& active);

/// Pairs of the consistent operator: the sides of the surface triangles of each local element.
std::vector<std::array<PetscInt, 2>> cotangent_pairs(const Surface& surface);

/// Sets weights and capacity to linear finite elements (cotangent weights) on the surface triangles: those of the mesh,
/// or two neighbouring corners of a quad and its centre, which is the mean of its corners and carries the lattice
/// particle's temperature. A flat sheet is therefore exact, whatever its thickness.
///
/// In conservation form, m_i dT_i/dt = sum over triangles of alpha sigma K_ij T_j, with the areal density sigma of the
/// element: with equal density this converges to alpha times the Laplacian, and it keeps sum_i m_i T_i always. The
/// fraction of a half of a quad's mass that the lattice particle has makes every row exact on a square grid. alpha is
/// the mean of the triangle's particles; areas are not taken below 1e-3 of the initial ones. Dead triangles do not
/// conduct.
/// @param diffusivity, positions see set_umbrella @param mass the capacity [kg], ghosts up to date, (1 x local)
/// @param active triangles that have not burnt, ghosts up to date
void set_cotangent(DiffusionGraph& graph, const Surface& surface, const std::vector<double>& diffusivity,
                   const Field& positions, const Field& mass, const ActiveSet& active);

}  // namespace pellicle::heat
