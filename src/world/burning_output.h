#pragma once

#include <string>
#include <vector>

#include "io/drawing.h"
#include "io/history.h"
#include "world/burning_fields.h"
#include "world/object.h"

namespace pellicle {

// What the books and the frames of sheets and balloons tell of heat and fire.

/// mass_left, mass_burnt, pieces, heat_content, heat_in, heat_out, heat_made, temperature_max.
const std::vector<History::Column>& burning_columns();

/// Their values. Collective.
/// @param capacity c [J/(kg K)]
std::vector<double> burning_row(const Surface& surface, const BurningFields& fields, double capacity);

/// pieces.csv: a row for each piece of each frame.
class PieceTable {
 public:
  /// Makes the file in a folder that has been started. Collective. @throws Error when it cannot be written
  /// @param resumed checkpoint from which the run goes on in its folder
  explicit PieceTable(const ObjectOutput& output, const Hdf5File* resumed = nullptr);

  /// Notes in a checkpoint how far the table is. Collective. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const { table_.save(checkpoint); }

  /// @param masses of the present pieces [kg]. Collective.
  void add(double time, int step, const Pieces& pieces, const std::vector<double>& masses);

 private:
  History table_;
};

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

}  // namespace pellicle
