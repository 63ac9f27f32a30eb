#pragma once

#include <string>
#include <vector>

#include "equilibrium/step_gas.h"
#include "equilibrium/time_scheme.h"
#include "gas/chambers.h"
#include "world/options.h"
#include "world/stage.h"
#include "world/state.h"

namespace pellicle::world {

/// The gas in the chambers of an object: mass and heat that it exchanges through links, holes and walls in a step, and
/// the forces of its weight. Its pressure acts in the balance of the motion (GasFilled).
class GasStage : public Stage {
 public:
  /// The chambers that the state numbers. All must outlive the stage. Collective.
  /// @param integrator of the motion
  /// @param origin, planes of symmetry, see Chambers
  GasStage(const Surface& surface, const Options& options, State& state, const TimeIntegrator& integrator = {},
           const Eigen::Vector3d& origin = Eigen::Vector3d::Zero(), const SymmetryPlanes& planes = {});

  const Chambers& chambers() const { return chambers_; }
  /// Data of the gas in the step in progress.
  const GasStep& step() const { return gas_step_; }
  /// Sets the gas in the balance, from which the stage takes the mass that has come into the chambers. It must outlive
  /// the steps.
  void set_filled(GasFilled& filled) { filled_ = &filled; }
  /// Mass and heat that the chambers have exchanged since time 0; zero where no chamber is joined to anything.
  const GasExchange& exchange() const { return state_.gas != nullptr ? *state_.gas : chambers_.initial_exchange(); }
  /// Forces of the weights of gas and air and of jets in the step in progress, of the local particles, ghosts up to
  /// date [N]; null: gas pushes evenly.
  const Field* uneven_forces() const { return pushes_unevenly_ ? &uneven_ : nullptr; }

  void start() override;
  void update_derived() override;
  StageResult begin(Step& step) override;
  StageResult end(Step& step) override;
  void report(Report& report, const Step& step) const override;

  /// Divides the chambers whose walls have come apart (Chambers::divided), in the state; then all stages must be made
  /// anew. Collective. @returns a line for each chamber that has been cut; none: the chambers are as they were
  std::vector<std::string> divide();
  /// Names a chamber that needs a closed surface but has a hole, or whose surface cracks have parted, with the element
  /// or vertex and the place, the same on all ranks. Empty: there is none. Collective. @param can_crack the surface
  std::string open_wall(bool can_crack) const;

 private:
  /// Heat that a particle of the wall gives to the gas of a chamber.
  struct WallShare {
    PetscInt particle;
    int chamber;
    double conductance;  ///< [W/K]
  };

  void begin_wall_heat(double h, ChamberWalls& walls);
  std::string end_wall_heat(double h, const Eigen::VectorXd& given);
  std::vector<bool> opened() const;
  void add_newly_open(const std::vector<bool>& before, double time, std::vector<std::string>& lines) const;
  std::string burnt_hole() const;
  std::string torn_wall() const;

  const Surface& surface_;
  const Options& options_;
  State& state_;
  TimeIntegrator integrator_;
  Chambers chambers_;
  GasStep gas_step_;
  std::vector<WallShare> wall_shares_;  ///< of the owned particles, if they have temperatures
  GasFilled* filled_ = nullptr;         ///< null: nothing presses
  bool pushes_unevenly_;
  Field uneven_;              ///< see uneven_forces
  Field between_;             ///< positions at which these act
  std::vector<bool> opened_;  ///< which chambers were open at the beginning of the step
};

}  // namespace pellicle::world
