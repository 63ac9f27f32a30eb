#pragma once

#include <array>
#include <string>
#include <vector>

#include "world/inflate.h"
#include "world/ledger.h"

namespace pellicle {
inline namespace world {

/// The history of a balloon: that of every object, with its gas, its wall and how its steps ended.
class BalloonLedger {
 public:
  /// Touches no file. Collective. @throws Error, on all ranks, if two columns have the same name
  BalloonLedger(const ObjectOutput& output, const Inflate& chain);
  /// Goes on with the tables of the run that has written a checkpoint, in its folder. Collective. @throws Error
  void resume(const Hdf5File& checkpoint);

  /// Notes in a checkpoint how long the table is, and what is known of the steps so far. Collective.
  /// @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;

  /// @param h length of the step [s]
  /// @param retries how often it was tried again. Collective.
  void add(const Inflate& chain, const BalloonState& state, const InflateStep& step, double h, int retries);

  /// A row of pieces.csv for each piece of a wall that burns. Collective.
  /// @param masses of the present pieces [kg]
  void add(double time, int step, const Pieces& pieces, const std::vector<double>& masses) {
    ledger_.add_pieces(time, step, pieces, masses);
  }

  /// Lines about all steps: how many ended out of balance, and how many may have had several equilibria. None if there
  /// were none.
  std::vector<std::string> remarks() const;

 private:
  const Options& options_;
  std::string group_;   ///< of the object in a checkpoint
  bool contact_apart_;  ///< see ObjectOutput
  Ledger ledger_;
  std::array<double, 2> cracks_{};    ///< sides and length, of the last row
  double initial_rubber_volume_ = 0;  ///< [m^3]
  int steps_ = 0;
  int steps_above_tolerance_ = 0;
  int worst_step_ = 0;     ///< of the steps that ended out of balance
  int concave_steps_ = 0;  ///< with InflateStep::concave_iterations
  int first_concave_step_ = 0;
  double worst_residual_ = 0;
  double last_residual_ = 0;  ///< relative, of the last step
};

}  // namespace world
}  // namespace pellicle
