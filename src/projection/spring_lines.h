#pragma once

#include <array>
#include <vector>

#include "surface/sheet.h"

namespace pellicle {
inline namespace projection {

/// Springs at each local particle, in compressed rows.
struct SpringIncidence {
  std::vector<PetscInt> offsets;  ///< (particles + 1)
  std::vector<PetscInt> springs;  ///< local numbers

  /// @param particles number of local particles
  SpringIncidence(const SpringSet& set, PetscInt particles);
};

/// The owned springs of one colour, ordered to lines. The springs of a colour are the edges of a quad net (burning
/// paper, section 7.1): at a regular particle four of them meet, and a line goes on in the opposite one. Lines come in
/// two families that cross each other.
///
/// Every owned spring is in one line. Two consecutive springs of a line share a particle; apart from such pairs no two
/// eliminated springs share one, on any rank: J W J^T of the eliminated springs is tridiagonal along each line.
struct SpringLines {
  std::vector<std::vector<PetscInt>> eliminated;  ///< local spring numbers along each line of one family
  std::vector<std::vector<PetscInt>> kept;        ///< of the other family, and the springs at which lines had to be cut
};

/// Finds the lines from the springs' ends alone. They are cut at the ranks' boundaries, at irregular particles, and at
/// one spring when they are closed. Collective.
SpringLines find_lines(const SpringSet& set, const Layout& particles);

}  // namespace projection
}  // namespace pellicle
