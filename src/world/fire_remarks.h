#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "world/options.h"

namespace pellicle::world {

/// The course of a fire so far, from which remarks at the end of a run are made.
struct FireRecord {
  double burnt = 0;         ///< fraction of the initial mass
  double last_time = -1;    ///< time of the last step in which mass was lost [s]; -1: there has been none
  double present_time = 0;  ///< time of the last step [s]
  double hottest = 0;       ///< the highest temperature so far [K]

  FireRecord() = default;
  /// @param numbers see `numbers`
  explicit FireRecord(const Eigen::VectorXd& numbers)
      : burnt(numbers[0]), last_time(numbers[1]), present_time(numbers[2]), hottest(numbers[3]) {}

  /// @param left, burnt_mass of all ranks [kg] @param temperature_max [K]
  void note(double time, double left, double burnt_mass, double temperature_max);
  /// The record as numbers of a state.
  Eigen::Vector4d numbers() const { return {burnt, last_time, present_time, hottest}; }
};

/// A line that gives the speed and the width in cells of a front of fire, if something can light one and it spreads
/// by itself; it names the remedy where the front is narrower than two cells. @param mean_side of the mesh [m]
std::vector<std::string> front_remarks(const Options& options, double mean_side);
/// A line if the fire has gone out before the end of a run, or nothing has caught fire.
std::vector<std::string> fire_remarks(const Options& options, const FireRecord& record);

}  // namespace pellicle::world
