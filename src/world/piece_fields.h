#pragma once

#include <vector>

#include "io/drawing.h"
#include "surface/pieces.h"

namespace pellicle {
inline namespace world {

/// What frames show of the piece that each local element belongs to.
class PieceFields {
 public:
  /// @param masses of the present pieces [kg]
  PieceFields(const Surface& surface, const Pieces& pieces, const std::vector<double>& masses);

  /// piece, piece_mass, piece_birth_time: views of this object.
  std::vector<DrawnField> drawn() const;

 private:
  std::vector<double> id_;
  std::vector<double> mass_;        ///< [kg]
  std::vector<double> birth_time_;  ///< [s]
};

}  // namespace world
}  // namespace pellicle
