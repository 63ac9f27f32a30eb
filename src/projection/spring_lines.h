#pragma once

#include <vector>

#include "base/incidence.h"
#include "surface/sheet.h"

namespace pellicle::projection {

/// Two consecutive springs of a line; the second may be a ghost.
struct SpringPair {
  PetscInt own;    ///< local number
  PetscInt other;  ///< local number
};

/// The end of a line at a separator.
struct LineEnd {
  std::size_t line;  ///< number in its family, on this rank
  std::size_t end;   ///< 0: the line's first spring is beside the separator, 1: its last
  SpringPair pair;   ///< this spring, and the separator
  PetscInt number;   ///< of the separator
};

/// This rank's parts of the lines of one family. Where a line continues on another rank, a spring on one side is a
/// separator, which is a line of its own. A line with one separator has it after its last spring. Separators are
/// numbered over all ranks along the lines.
struct LineFamily {
  std::vector<std::vector<PetscInt>> lines;  ///< local spring numbers along each
  std::vector<PetscInt> separators;          ///< of this rank
  std::vector<PetscInt> numbers;             ///< of the separators
  std::vector<LineEnd> ends;                 ///< of other lines at separators
  std::vector<SpringPair> neighbours;        ///< separators beside each other, each pair on one rank
  std::vector<PetscInt> neighbour_numbers;   ///< smaller number of each pair
  PetscInt separators_of_all = 0;            ///< number of separators of all ranks
};

/// The owned springs of one colour, arranged in lines. The springs of a colour are the edges of a quad net (burning
/// paper, section 7.1): at a regular particle four of them meet, and a line continues in the opposite one. Lines form
/// two families that cross each other, the same on all ranks where possible.
///
/// Every owned spring is in one line. Eliminated springs share a particle only if they are consecutive in a line,
/// separators included, on any rank: so J W J^T of the eliminated springs is tridiagonal along lines.
struct SpringLines {
  LineFamily eliminated;  ///< one family
  LineFamily kept;        ///< the other family, and springs at which lines had to be cut
};

/// Finds the lines from the springs' ends alone. They are cut at the ranks' boundaries, at irregular particles, and at
/// one spring when they are closed on one rank. Collective.
SpringLines find_lines(const SpringSet& set, const Layout& particles);

}  // namespace pellicle::projection
