#pragma once

#include <map>
#include <string>
#include <vector>

#include "ablation/ablation.h"
#include "ablation/cracks.h"
#include "base/stage_clock.h"
#include "contact/bodies.h"
#include "heat/conduction.h"
#include "world/options.h"
#include "world/stage.h"
#include "world/state.h"
#include "world/textures.h"

namespace pellicle {
inline namespace world {

// Stages that heat, burn, cut and crack a surface, of a sheet or of a wall. They work on State::burning. Surface,
// options, state and clock must outlive them; constructors are collective.

/// Heat from sources, burning, surroundings and bodies, and its conduction (burning paper, section 5).
class HeatStage : public Stage {
 public:
  /// @throws Error on textures that cannot be read or are asked for on a surface without texture coordinates, and on
  /// contradicting options
  HeatStage(const Surface& surface, const Options& options, State& state, StageClock& clock, Textures& textures);

  void start() override;
  StageResult begin(Step& step) override;
  void report(Report& report, const Step& step) const override;
  std::vector<std::string> first_remarks() const override;

 private:
  const Surface& surface_;
  const Options& options_;
  State& state_;
  StageClock& clock_;
  std::map<std::string, std::vector<double>> source_texture_;  ///< sampled values of the heat textures
  std::vector<Body> bodies_;                                   ///< if any of them exchanges heat
  double resting_gap_ = 0;                                     ///< at which the surface comes to rest on them [m]
  Conduction conduction_;
  Field rise_;  ///< of the temperatures by conduction [K]
};

/// Particles that are hot enough lose mass (burning paper, eq. 4).
class CombustionStage : public Stage {
 public:
  /// @throws Error as HeatStage does
  CombustionStage(const Surface& surface, const Options& options, State& state, StageClock& clock, Textures& textures);

  StageResult begin(Step& step) override;

 private:
  const Surface& surface_;
  const Options& options_;
  State& state_;
  StageClock& clock_;
  Ablation ablation_;
  std::vector<double> mass_loss_factor_;  ///< of the local particles, or empty
};

/// Removes burnt material from the surface (burning paper, section 6), and draws the rest.
class AblationStage : public Stage {
 public:
  AblationStage(const Surface& surface, const Options& options, State& state, StageClock& clock);

  void start() override;
  void update_derived() override { ablation_.follow_triangles(state_.burning->active); }
  StageResult begin(Step& step) override;
  void draw(Picture& picture) const override;

 private:
  void remove_bare_particles(double time);

  const Surface& surface_;
  const Options& options_;
  State& state_;
  StageClock& clock_;
  Ablation ablation_;
  std::vector<double> level_;  ///< see level_set
};

/// Cracks the surface where its motion has pulled it too hard.
class CrackStage : public Stage {
 public:
  /// @param motion of the object, which knows the stress
  CrackStage(const Surface& surface, const Options& options, State& state, StageClock& clock, Textures& textures,
             MotionStage& motion);

  StageResult end(Step& step) override;
  void report(Report& report, const Step& step) const override;
  std::vector<std::string> first_remarks() const override;
  std::vector<std::string> remarks() const override;

 private:
  /// Sides that have cracked and their undeformed length [m], of all ranks. Collective.
  std::array<double, 2> sums() const;

  const Surface& surface_;
  const Options& options_;
  State& state_;
  StageClock& clock_;
  Ablation ablation_;
  Cracks cracks_;
  MotionStage& motion_;
};

/// Refuses a step whose heat does not add up: the heat content must be the initial content plus the heat that came in
/// and was made, less the heat that went out. It also keeps the course of the fire, for remarks.
class HeatBalanceStage : public Stage {
 public:
  HeatBalanceStage(const Surface& surface, const Options& options, State& state);

  StageResult end(Step& step) override;
  void report(Report& report, const Step& step) const override;
  std::vector<std::string> remarks() const override;

 private:
  FireFigures figures() const;

  const Surface& surface_;
  const Options& options_;
  State& state_;
  mutable std::vector<double> level_;  ///< see level_set; kept so that a step allocates nothing
};

}  // namespace world
}  // namespace pellicle
