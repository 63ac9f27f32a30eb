#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "base/stage_clock.h"
#include "contact/bodies.h"
#include "io/history.h"
#include "surface/surface.h"
#include "world/burning_fields.h"
#include "world/fire_remarks.h"
#include "world/object.h"

namespace pellicle {
inline namespace world {

/// The columns of a body's load: force_NAME_x, _y and _z, gap_NAME.
std::vector<History::Column> body_columns(const std::vector<std::string>& names);
/// Their values; zeros for the initial state, which has no loads.
std::vector<double> body_values(std::size_t bodies, const std::vector<BodyLoad>& loads);

/// Values of a row of the history, of any object.
struct LedgerRow {
  const Surface& surface;
  const ObjectState& state;
  const double* mass;            ///< of the owned particles [kg]
  const BurningFields* burning;  ///< null: nothing burns
  double capacity = 0;           ///< c of what burns [J/(kg K)]
  double loss_mass = 0;          ///< m^loss of what burns, as a share of m^init
  double h = 0;                  ///< length of the step [s]
  int retries = 0;               ///< how often it was tried again
};

/// A line about the cracks of a run. @param cracks sides, and their undeformed length [m]
std::string crack_line(const std::array<double, 2>& cracks);

/// The history of an object: a row of history.csv for the initial state and for each step, and where something burns
/// the pieces of each frame in pieces.csv. Every object's row has time, step, time_step, retries; mass_left,
/// mass_burnt, pieces, heat_content, heat_in, heat_out, heat_made, temperature_max, if it burns; kinetic_energy and
/// momentum; then the columns of its kind, and the seconds of its stages.
class Ledger {
 public:
  /// Touches no file. @throws Error, the same on all ranks, if two columns have the same name
  /// @param own the columns that only objects of this kind have
  Ledger(const ObjectOutput& output, bool burns, const std::vector<History::Column>& own);
  /// Goes on with the tables of the run that has written a checkpoint, in its folder. Collective. @throws Error
  void resume(const Hdf5File& checkpoint);

  /// Notes in a checkpoint how long the tables are. Collective. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;

  /// Adds a row. Collective. @param own of its own columns
  void add(const LedgerRow& row, const std::vector<double>& own);

  /// Lines about a fire, if anything burns.
  std::vector<std::string> remarks(const Options& options) const {
    return pieces_ != nullptr ? fire_remarks(options, fire_) : std::vector<std::string>();
  }

  /// Adds a row to pieces.csv for each piece. Collective. @param masses of the present pieces [kg]
  void add_pieces(double time, int step, const Pieces& pieces, const std::vector<double>& masses);

 private:
  const StageClock& clock_;
  std::string group_;  ///< of the object in a checkpoint
  FireRecord fire_;
  std::unique_ptr<History> history_;
  std::unique_ptr<History> pieces_;  ///< if it burns
};

}  // namespace world
}  // namespace pellicle
