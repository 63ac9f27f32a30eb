#pragma once

#include <map>
#include <string>
#include <vector>

#include "ablation/ablation.h"
#include "ablation/cracks.h"
#include "base/stage_clock.h"
#include "contact/bodies.h"
#include "heat/conduction.h"
#include "io/texture.h"
#include "world/options.h"
#include "world/stage.h"
#include "world/state.h"

namespace pellicle::world {

/// A stage that heats, burns, cuts or cracks a surface, of a sheet or of a wall.
class FireStage : public Stage {
 public:
  /// All must outlive the stage. Collective, as the constructors of its kinds are.
  FireStage(const Surface& surface, const Options& options, State& state, StageClock& clock)
      : surface_(surface), options_(options), state_(state), fields_(*state.burning), clock_(clock) {}

 protected:
  const Surface& surface_;
  const Options& options_;
  State& state_;
  BurningFields& fields_;  ///< of the state
  StageClock& clock_;
};

/// Heat from sources, burning, surroundings and bodies, and its conduction (burning paper, section 5).
class HeatStage : public FireStage {
 public:
  /// @throws Error on textures that cannot be read or are asked for on a surface without texture coordinates, and on
  /// contradicting options
  HeatStage(const Surface& surface, const Options& options, State& state, StageClock& clock, Textures& textures);

  void start() override;
  StageResult begin(Step& step) override;
  void report(Report& report, const Step& step) const override;
  std::vector<std::string> first_remarks() const override;

 private:
  std::map<std::string, std::vector<double>> source_texture_;  ///< sampled values of the heat textures
  std::vector<Body> bodies_;                                   ///< if any of them exchanges heat
  double resting_gap_ = 0;                                     ///< at which the surface comes to rest on them [m]
  Conduction conduction_;
  Field rise_;  ///< of the temperatures by conduction [K]
};

/// Particles that are hot enough lose mass (burning paper, eq. 4).
class CombustionStage : public FireStage {
 public:
  /// @throws Error as HeatStage does
  CombustionStage(const Surface& surface, const Options& options, State& state, StageClock& clock, Textures& textures);

  StageResult begin(Step& step) override;

 private:
  std::vector<double> mass_loss_factor_;  ///< of the local particles, or empty
};

/// Removes burnt material from the surface (burning paper, section 6), and draws the rest.
class AblationStage : public FireStage {
 public:
  using FireStage::FireStage;

  void start() override;
  void update_derived() override { follow_triangles(surface_, options_.ablation.spring_rule, fields_.active); }
  StageResult begin(Step& step) override;
  void draw(Picture& picture) const override;

 private:
  void remove_bare_particles(double time);

  std::vector<double> level_;  ///< see level_set
};

/// Cracks the surface where its motion has pulled it too hard.
class CrackStage : public FireStage {
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

  Cracks cracks_;
  MotionStage& motion_;
};

/// Notes a step in a record of a fire (FireRecord). @param left, burnt masses of all ranks [kg]
/// @param temperature_max [K]
void note_fire(Eigen::VectorXd& record, double time, double left, double burnt, double temperature_max);
/// A line that gives the speed and the width in cells of a front of fire, if something can light one and it spreads
/// by itself; it names the remedy where the front is narrower than two cells. @param mean_side of the mesh [m]
std::vector<std::string> front_remarks(const Options& options, double mean_side);
/// A line if the fire has gone out before the end of a run, or nothing has caught fire. @param record see FireRecord
std::vector<std::string> fire_remarks(const Options& options, const Eigen::VectorXd& record);

/// Refuses a step whose heat does not add up: the heat content must be the initial content plus the heat that came in
/// and was made, less the heat that went out. It also keeps the course of the fire, for remarks.
class HeatBalanceStage : public FireStage {
 public:
  using FireStage::FireStage;

  StageResult end(Step& step) override;
  void report(Report& report, const Step& step) const override;
  std::vector<std::string> remarks() const override;

 private:
  FireFigures figures() const;

  mutable std::vector<double> level_;  ///< see level_set; kept so that a step allocates nothing
};

}  // namespace pellicle::world
