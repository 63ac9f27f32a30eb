#pragma once

#include <functional>
#include <vector>

#include "constraints/pins.h"
#include "energies/step_part.h"

namespace pellicle::equilibrium {

/// Another part of a step without inertia, along the path of its equilibria: the time t of its loads is an unknown,
/// too. The row of the residual is a scale times sum_i w_i c_i.(x_i - x_i^n) - s (Riks, see LoadBorder), with the
/// direction c of the path, the length s of the step on it and the vertices' fractions w of the mass. c and lengths
/// include free motions only.
class PathPart : public ExtendedPart {
 public:
  /// All must outlive it. Collective.
  /// @param set_time changes the time of the loads on the part [s], which is to forget its values; called on all ranks
  /// @param mass of the owned vertices, at least @param arc_length root-mean-square displacement of the free vertices
  /// in a second [m/s]
  PathPart(StepPart& part, std::function<void(double)> set_time, const Pins& pins, const std::vector<double>& mass,
           double arc_length);

  /// Begins a step, after the part. Newton's first iteration follows the tangent of the path. Collective.
  /// @param time of the loads at its start [s] @param h [s]
  /// @param direction of the last step (`write_direction`); 0: in the first one the path goes to where the loads push
  void begin_step(double time, double h, const Field& direction);
  /// Time of the loads [s].
  double time() const { return time_; }
  /// Writes the direction, of all local vertices, from the start of this step to `position`, with root mean square 1.
  /// Collective.
  void write_direction(const Field& position, Field& direction) const;

  bool move_to(const Field& position, const Eigen::VectorXd& own) override;
  Eigen::VectorXd own_unknowns() const override { return Eigen::VectorXd::Constant(1, time_); }
  Eigen::VectorXd own_rows() const override;
  /// One column more than the part, for the additional row.
  int columns() const override { return part_.columns() + 1; }
  LowRank dense_tangent() override;
  bool follows_path() const override { return true; }
  Eigen::VectorXd load_rate() override;

 private:
  void set_unit_length(Field& direction) const;

  std::function<void(double)> set_time_;
  const Pins& pins_;
  const std::vector<double>& mass_;
  double total_mass_ = 0;  ///< [kg]
  double arc_length_;      ///< [m/s]
  double time_ = 0;
  double h_ = 0;
  Field direction_;  ///< c
  Field position_;   ///< x with what is pinned in its places
};

}  // namespace pellicle::equilibrium
