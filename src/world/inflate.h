#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/stage_clock.h"
#include "equilibrium/implicit_step.h"
#include "prism/volume_preservation.h"
#include "world/balloon_state.h"
#include "world/options.h"

namespace pellicle {

/// How a step of the balloon went.
struct InflateStep : ImplicitResult {
  double step_error = 0;  ///< |x - x^n - h v^n| / 2 at most, over the square root of the wall's area
};

/// The chain of the balloon paper (Algorithm 1): gas and implicit step, volume preservation, velocities.
class Inflate {
 public:
  /// Builds the wall, its gas and what holds it. Membrane, options and clock must outlive it. Collective.
  /// @throws Error on bad materials, textures, regions, chambers, pins, planes and loads
  Inflate(const Membrane& membrane, const Options& options, StageClock& clock);

  /// The undeformed shape with its initial noise, at rest at time 0, pins in their places. Collective.
  BalloonState initial_state() const;

  /// One step of length h from `state.time`; the caller restores the state when it did not converge. Collective.
  InflateStep advance(BalloonState& state, double h);

  /// Forgets what solvers know of the steps so far: the next step is the same as that of a new chain. Collective.
  void forget() { make_solvers(); }

  /// The gas of a chamber at the state's time, with its present pressure. @param volume as Chambers::volumes gives it
  GasState gas(int chamber, double volume, const BalloonState& state) const;

  const PrismElements& elements() const { return elements_; }
  const Chambers& chambers() const { return chambers_; }
  const std::vector<double>& mass() const { return mass_; }

  /// The names of the stages, for the clock.
  static const std::vector<std::string>& stage_names();

 private:
  void make_solvers();
  /// What the gas has at the state's positions and time; prescribed volumes keep their multipliers. Collective.
  void set_pressures(BalloonState& state) const;

  const Membrane& membrane_;
  const Options& options_;
  StageClock& clock_;
  Wall wall_;
  std::vector<double> mass_;  ///< of the owned vertices [kg]
  PrismElements elements_;
  Pins pins_;
  Constraints constraints_;
  Chambers chambers_;
  PointLoads loads_;
  std::optional<ImplicitStep> implicit_;
  std::unique_ptr<VolumePreservation> volume_preservation_;  ///< if the wall's rule asks for it
  Field start_;                                              ///< positions at the beginning of the step
};

}  // namespace pellicle
