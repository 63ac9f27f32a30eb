#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ablation/tearing.h"
#include "air/drag_potential.h"
#include "base/stage_clock.h"
#include "base/stage_result.h"
#include "constraints/pins.h"
#include "contact/bodies.h"
#include "contact/body_contact.h"
#include "contact/body_correction.h"
#include "elastic/spring_sheet.h"
#include "equilibrium/equilibrium.h"
#include "equilibrium/gas_filled_part.h"
#include "gas/chambers.h"
#include "projection/successive_projection.h"
#include "surface/net_strain.h"
#include "world/burning.h"
#include "world/gas_heat.h"
#include "world/gas_push.h"
#include "world/options.h"
#include "world/state.h"
#include "world/textures.h"

namespace pellicle {
inline namespace world {

/// Sums of a step of the burning sheet for the ledger.
struct BurnStep {
  bool converged = true;
  std::string reason;  ///< of a failure, in words
  int heat_iterations = 0;
  int dynamics_iterations = 0;
  double constraint_error = 0;             ///< ||C|| at the end [m]
  int newton_iterations = 0;               ///< of an elastic sheet
  double force_residual = 0;               ///< norm of the sum of all forces over the largest kind of force
  double elastic_energy = 0;               ///< see Burn::elastic_energy
  PetscInt contacts = 0;                   ///< particles of this rank held by a body at the end
  std::vector<BodyLoad> loads;             ///< of the bodies, in the order of their names
  std::optional<ContactFigures> touching;  ///< of a sheet that touches itself, or others
  std::optional<double> step_error;        ///< with time.tolerance, see Burn::step_error
  bool died = false;                       ///< whether a part of the sheet burnt away, on any rank
  bool cracked = false;                    ///< whether a side of its cells cracked, on any rank

  void take(const StageResult& result) {
    converged = result.converged;
    reason = result.reason;
  }
};

/// Result of the stage that moves the sheet. Its error is ||C|| at the end [m].
struct DynamicsResult : StageResult {
  PetscInt contacts = 0;  ///< particles of this rank held by a body at the end
  int newton_iterations = 0;
  double force_residual = 0;    ///< see BurnStep
  std::vector<BodyLoad> loads;  ///< likewise
  std::optional<double> step_error;
};

/// The chain of the burning paper: heat, combustion, ablation, external force, projection with contact, velocity
/// (section 4); then sides of cells crack, if they can. Where cracks separate the sheet its numbering has to be renewed
/// between steps (surface/split_corners.h), as BurnRun does.
///
/// A step is begun, brought into balance by an Equilibrium, alone or with what it touches or is linked to, and ended. A
/// program with stages of its own calls the stages of this class itself, and its own between them (tests/external).
class Burn : public Motion {
 public:
  /// Reads textures, builds operators. Sheet, options and clock must outlive it. Collective.
  /// @throws Error on textures that cannot be read or are asked for on a sheet without texture coordinates, and on
  /// contradicting options
  Burn(const Sheet& sheet, const Options& options, StageClock& clock);

  /// The chain of a sheet that goes on from a state: what is pinned, and which cells bound chambers, is known.
  Burn(const Sheet& sheet, const Options& options, StageClock& clock, const State& state);

  /// The same chain for what is left of the sheet, which must outlive it; the old chain is used up. Collective.
  Burn(const Sheet& left, Burn&& before, const State& state);

  /// The state at time 0. Collective.
  State initial_state() const;
  /// Updates what follows from the positions of the state at time 0, in case they have changed. Collective.
  void follow_start(State& state) const;

  /// Makes what follows from the other fields: target lengths from masses, living springs from living triangles. To be
  /// called before the first step of a state, which must outlive the steps. Collective.
  void follow(State& state);

  // One step of length h from `state.time`, which stays where it is until the step has been ended; the caller restores
  // the state when the step did not converge. Collective.

  /// All stages up to the balance.
  BurnStep begin(State& state, double h);
  StepPart* part() override;
  std::string stage() const override { return "projection"; }
  GasFilled* gas() override { return filled_ ? static_cast<GasFilled*>(&*filled_) : pushed_ ? &*pushed_ : nullptr; }
  void choose_pressures() override;
  StageResult move(bool& is_done) override;
  std::string start_fault() const override {
    return body_contact_ != nullptr ? body_contact_->start_fault() : bodies_.start_fault();
  }
  std::string passed_limit() const override;
  ContactSurface::Part contact_part() const override { return {&sheet_, options_.contact.thickness, stiffness_}; }
  const std::vector<bool>* living() const override { return &state_->living.triangles; }
  std::vector<bool> held() const override { return held_; }
  /// The rest of the step. @param balance how it was found @param step result of `begin`
  void end(State& state, const EquilibriumResult& balance, BurnStep& step);

  // The stages of a step of length h [s], in the order in which a step runs them. They read and leave fields with
  // ghosts up to date. After one that has not converged the state may be anything. Collective.

  /// Sources, burning, surroundings and conduction change the temperatures.
  StageResult heat(State& state, double h);
  /// What is hot enough loses mass, and its springs shrink.
  void combustion(State& state, double h);
  /// Removes what has burnt from the sheet. @returns whether there was anything, on any rank
  bool ablation(State& state, double h);
  /// Changes velocities by gravity, damping and air, positions by the velocities, up to the balance, which corrects
  /// both. To apply a force F of one's own, add h F/m to the velocities before.
  StageResult begin_dynamics(State& state, double h);
  /// Velocities, and the work of the step, from the balance.
  DynamicsResult end_dynamics(State& state, const EquilibriumResult& balance);
  /// Cracks what the motion has pulled too hard, if anything can crack. @returns whether anything has, on any rank
  bool tear(State& state);
  /// Moves the clock, unless heat is unaccounted for: a stage that heats or cools by itself adds what the particles of
  /// this rank got or gave to `state.heat_in` or `state.heat_out`.
  StageResult end_step(State& state, double h);

  const Options& options() const { return options_; }
  const Chambers& chambers() const { return chambers_; }
  /// All that the sheet may meet, however they move it.
  const std::vector<Body>& bodies() const { return body_contact_ ? body_contact_->bodies() : bodies_.bodies(); }
  /// See Cracks::remark; empty if nothing can crack.
  std::string crack_remark() const { return tearing_ ? tearing_->remark() : ""; }
  /// See SpringSheet; 1 of what is projected. Collective.
  double largest_excess() const { return springs_ != nullptr ? springs_->largest_excess() : 1; }

  /// Of the sheet as it is now; of an elastic one the mean is that of the springs that have stiffness. Collective.
  NetStrain net_strain(const State& state) const;
  /// Energy of springs and bending, without viscosity; 0 of a projected sheet. Collective. [J]
  double elastic_energy(const State& state);

  /// The names of the stages, for the clock.
  static const std::vector<std::string>& stage_names();

  /// ||C|| of each colour in the last step, if `project.monitor` asks for it.
  const std::vector<ProjectionError>& projection_errors() const {
    return projection_ != nullptr ? projection_->monitored() : no_errors_;
  }

 private:
  Burn(const Sheet& sheet, const Options& options, StageClock& clock, Textures textures, const State* state);
  void make_springs();
  std::vector<Potential*> pressing();
  void set_stiffness_factors(const Field& mass);
  void set_lengths(State& state);
  BurnStep begin_burning(State& state, double h);
  ContactStep move_freely(State& state, double h);
  bool waits_for_gas() const;
  StageResult project(State& state, bool& is_done);
  DynamicsResult hold_together(State& state, const ContactStep& contact);
  void begin_masses(const State& state, const Field& positions, double h);
  void begin_bodies(const State& state, double h);
  void take_balance(State& state, const EquilibriumResult& balance);
  void ask_bodies(const State& state, DynamicsResult& result) const;
  void find_velocities(State& state, const ContactStep& contact, std::vector<BodyLoad>& loads);
  void add_spring_forces(const State& state, Eigen::Matrix3Xd& sum);
  double step_error(const State& state, double h) const;
  SheetInput sheet_input(const State& state, double h) const;
  /// A projected sheet has no statics: a scheme that a later option has made useless does not act.
  bool is_static() const {
    return options_.time.scheme == TimeScheme::statics && options_.dynamics != Dynamics::projection;
  }
  void add_work(State& state);
  double kinetic_energy(const State& state) const;
  void lift(State& state, double h);
  void begin_gas(State& state, double h);
  std::string end_gas(State& state);
  void leave_bodies(State& state, const ContactStep& contact, std::vector<BodyLoad>& loads);

  const Sheet& sheet_;
  const Options& options_;
  StageClock& clock_;
  Textures textures_;
  Burning burning_;
  Pins pins_;
  BodyCorrection bodies_;                      ///< that move the sheet; none if there are any in body_contact_
  std::unique_ptr<BodyContact> body_contact_;  ///< bodies whose pressing is brought into balance
  std::optional<AirDrag> air_;                 ///< if there is air
  std::unique_ptr<Potential> weight_;          ///< of a sheet in a step of statics, part of its balance
  std::unique_ptr<Potential> drag_;            ///< of the air on a sheet of springs, part of its balance
  Chambers chambers_;
  GasStep gas_step_;                 ///< of their gas
  std::optional<PushedGas> pushed_;  ///< if it has chambers, and is projected
  GasHeat gas_heat_;
  std::optional<Tearing> tearing_;
  State* state_ = nullptr;                    ///< whose steps these are
  std::optional<ContactStep> moving_;         ///< the step in progress
  DynamicsResult moved_;                      ///< what it says
  std::optional<GasFilledPart> filled_;       ///< if it has chambers, and springs
  std::array<std::vector<double>, 4> force_;  ///< of the owned springs in the last step, see Tearing [N]
  // One of the first two, as `dynamics` says.
  std::unique_ptr<SpringSheet> springs_;
  std::unique_ptr<SuccessiveProjection> projection_;
  std::unique_ptr<MassPart> masses_;        ///< of a sheet that is projected and touches itself or others
  int projections_ = 0;                     ///< so often has it been projected again in the step, see move
  std::vector<ProjectionError> no_errors_;  ///< of what is not projected
  // Of the local particles in the present step.
  Field start_;                     ///< positions at the beginning
  Field end_;                       ///< of a sheet that gas pushes: where it has come to
  Field start_velocity_;            ///< velocities then [m/s]
  Eigen::Matrix3Xd unconstrained_;  ///< positions without springs and bodies
  std::optional<GasPush> push_;     ///< of a sheet that gas pushes
  Eigen::Matrix3Xd free_position_;  ///< likewise: positions without springs, bodies and gas
  Eigen::Matrix3Xd free_velocity_;  ///< velocities without them
  std::vector<bool> held_;          ///< those that are pinned or have left
  std::vector<double> mass_;        ///< that moves with them, as inertia: see move_freely [kg]
  std::vector<double> holding_;     ///< of statics, in place of it [kg]
  bool pins_move_ = false;          ///< some are led along paths
  double fading_ = 0;               ///< c h of velocities, see move_freely
  /// Arrays over the owned particles that add_work uses. They are kept so that a step allocates nothing.
  struct {
    Eigen::Matrix3Xd moved;   ///< in the step [m]
    Eigen::Matrix3Xd forces;  ///< of one kind [N]
    Eigen::Matrix3Xd all;     ///< their sum [N]
    Eigen::VectorXd works;    ///< on this rank, then on all [J]
  } work_;
  std::optional<Field> spring_force_;     ///< see add_spring_forces; where pins move
  Eigen::Matrix3Xd lift_;                 ///< forces of the weights of gas and air, and of jets, if there are any [N]
  double size_ = 0;                       ///< square root of its undeformed area, with time.tolerance [m]
  double usual_stiffness_ = 0;            ///< of contact in steps of the deck's length [Pa/m]
  double stiffness_ = 0;                  ///< of contact, in the present step [Pa/m]
  std::vector<double> volume_ratio_;      ///< see set_volume_ratios
  std::vector<double> stiffness_factor_;  ///< see set_stiffness_factors
};

}  // namespace world
}  // namespace pellicle
