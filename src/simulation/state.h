#pragma once

#include "ablation/pieces.h"
#include "combustion/combustion.h"
#include "mesh/field.h"
#include "mesh/living.h"
#include "mesh/sheet.h"

namespace pellicle {

/// All that changes from step to step. Fields live on the sheet's particles, ghosts up to date between steps.
struct State {
  /// Everything lives and is at rest; the pieces are yet to be found. Collective.
  explicit State(const Sheet& sheet);

  double time = 0;    ///< [s]
  int step = 0;       ///< accepted steps
  Field position;     ///< x [m]
  Field velocity;     ///< v [m/s]
  Field temperature;  ///< T [K]
  Field mass;         ///< m [kg]; 0: the particle has left the sheet
  Field mass_change;  ///< of the last step, at most 0 [kg]
  TargetLengths target_length;
  Living living;
  Pieces pieces;
  std::vector<double> burn_time;  ///< when each local cell began to burn away or to tear [s]; -1: not yet
  double mass_burnt = 0;  ///< since the beginning, by the owned particles, with what was left when they left [kg]
  double heat_in = 0;     ///< from sources and burning since the beginning, owned particles [J]
  double heat_out = 0;    ///< to the surroundings and with the mass that burnt, likewise [J]
};

/// A copy of a state's values, to put back when a step fails.
class Snapshot {
 public:
  explicit Snapshot(const State& state);
  void restore(State& state) const;

 private:
  double mass_burnt_;
  double heat_in_;
  double heat_out_;
  Eigen::MatrixXd position_;
  Eigen::MatrixXd velocity_;
  Eigen::MatrixXd temperature_;
  Eigen::MatrixXd mass_;
  Eigen::MatrixXd mass_change_;
  TargetLengths target_length_;
  Living living_;
  Pieces pieces_;
  std::vector<double> burn_time_;
};

}  // namespace pellicle
