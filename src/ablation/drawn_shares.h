#pragma once

#include <vector>

#include "parallel/field.h"
#include "surface/drawn_surface.h"
#include "surface/living.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace ablation {

/// Spreads what the particles of a sheet have, such as mass, over what is drawn of its cells, so that nothing is left
/// out: the sum of density times area over the drawn triangles of all ranks is the sum over the particles.
///
/// A particle gives to the cells at it in proportion to their initial masses and to how much of each is drawn. In as
/// far as its cells are not drawn, because it has burnt but springs still hold it, it gives to the particles beside it
/// instead, in proportion to how much of their cells is drawn, and these to their cells.
class DrawnShares {
 public:
  /// The sheet must outlive this object. Collective.
  /// @param surface of this rank, from cut_surface
  /// @param positions [m], ghosts up to date, (3 x local)
  DrawnShares(const Sheet& sheet, const Living& living, const DrawnSurface& surface, const Field& positions);

  /// Amount per drawn area of each local cell; 0 where nothing is drawn, and of other ranks' cells. Collective.
  /// @param amount of the local particles, ghosts up to date, (1 x local)
  std::vector<double> density(const Field& amount) const;

 private:
  /// A particle none of whose cells is drawn, and a cell with a living triangle that shares one of its springs.
  struct Held {
    PetscInt particle;
    std::size_t cell;
  };

  void find_held(const Living& living);

  const Sheet& sheet_;
  std::vector<double> area_;  ///< that is drawn, of the owned cells [m^2]
  Field cell_weight_;         ///< initial mass of the drawn part of each cell, at its lattice particle [kg]
  Field weight_;              ///< of the drawn cells of each particle, added up [kg]
  Field drawn_;               ///< share of each particle's cells that is drawn
  std::vector<Held> held_;    ///< by springs of this rank
  Field given_;               ///< by each particle to others: the weights of those that take, added up
};

}  // namespace ablation
}  // namespace pellicle
