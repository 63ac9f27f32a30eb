#pragma once

#include <vector>

#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/drawn_surface.h"
#include "surface/sheet.h"

namespace pellicle::ablation {

/// Distributes an amount of the particles of a sheet, such as mass, over the drawn part of its cells without loss: the
/// sum of density times area over the drawn triangles of all ranks is the sum over the particles.
///
/// A particle's amount goes to the cells at it in proportion to their initial masses and drawn shares. The part for
/// cells that are not drawn, at a burnt particle that springs still hold, goes to the neighbouring particles in
/// proportion to the drawn fractions of their cells, and from these to their cells.
class DrawnShares {
 public:
  /// The sheet must outlive this object. Collective.
  /// @param surface of this rank, from cut_surface
  /// @param positions [m], ghosts up to date, (3 x local)
  DrawnShares(const Sheet& sheet, const ActiveSet& active, const DrawnSurface& surface, const Field& positions);

  /// Amount per drawn area of each local cell; 0 of undrawn cells and of other ranks' cells. Collective.
  /// @param amount of the local particles, ghosts up to date, (1 x local)
  std::vector<double> density(const Field& amount) const;

 private:
  /// A particle, and a cell among whose particles it divides what it does not keep: one of its own, or if none of these
  /// is drawn one with an active triangle that shares one of its springs.
  struct Giving {
    PetscInt particle;
    std::size_t cell;
  };

  void find_held(const ActiveSet& active);

  const Sheet& sheet_;
  std::vector<double> area_;    ///< drawn area of the owned cells [m^2]
  Field cell_weight_;           ///< initial mass of the drawn part of each cell, at its lattice particle [kg]
  Field weight_;                ///< sum of cell_weight_ over the cells of each particle [kg]
  Field drawn_;                 ///< fraction of each particle's cells that is drawn
  std::vector<Giving> giving_;  ///< of owned active cells, then from springs of this rank
  Field given_;                 ///< by each particle to others: the sum of the receivers' weights
};

}  // namespace pellicle::ablation
