#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ablation/cracks.h"
#include "air/drag_potential.h"
#include "base/stage_clock.h"
#include "equilibrium/equilibrium.h"
#include "equilibrium/step_potential.h"
#include "prism/volume_preservation.h"
#include "prism/wall_bending.h"
#include "world/balloon_state.h"
#include "world/burning.h"
#include "world/gas_heat.h"
#include "world/options.h"

namespace pellicle {
inline namespace world {

/// How a step of the balloon went.
struct InflateStep : ImplicitResult {
  int heat_iterations = 0;
  std::vector<BodyLoad> loads;             ///< of the bodies, in the order of their names
  std::optional<ContactFigures> touching;  ///< of a balloon that touches itself, or others
  double step_error = 0;                   ///< TimeIntegrator::error at most, over the square root of the wall's area
  PetscInt inverted = 0;                   ///< elements that have turned over (PrismElements::inverted), on all ranks
  bool has_burnt = false;                  ///< whether an element burnt away, on any rank
  bool has_cracked = false;                ///< whether a side of its elements cracked, on any rank
};

/// Gives the membrane of a balloon that burns what that takes (set_burnable): the masses of its wall. Leaves others as
/// they are. To be called before its Inflate is made. Collective.
/// @throws Error as Inflate does
void make_burnable(Membrane& membrane, const Options& options);

/// A state of all that a chain with these options changes, at rest in the undeformed shape. Collective.
/// @param chambers their number
BalloonState state_at_rest(const Membrane& membrane, const Options& options, int chambers);

/// The chain of the balloon paper (Algorithm 1): gas and implicit step, volume preservation, velocities. Where the wall
/// burns (balloon_burns) heat, combustion and ablation come before; then sides of elements crack, if they can. Where
/// cracks separate the wall its numbering has to be renewed between steps (surface/split_corners.h), as InflateRun
/// does. By generalized alpha (TimeOptions::scheme) the step starts from accelerations, too, which follow from the
/// forces in the first one.
class Inflate : public Motion {
 public:
  /// Builds the wall, its gas and what holds it. Membrane, options and clock must outlive it. Collective.
  /// @throws Error on bad materials, textures, regions, chambers, pins, planes and loads
  Inflate(const Membrane& membrane, const Options& options, StageClock& clock);

  /// The chain that goes on from a state, which says what is pinned, loaded and filled with gas.
  Inflate(const Membrane& membrane, const Options& options, StageClock& clock, const BalloonState& state);

  /// The same for a wall that cracks have parted; the chain before is used up. Collective.
  Inflate(const Membrane& parted, Inflate&& before, const BalloonState& state);

  /// The undeformed shape with its initial noise, at rest at time 0, pins in their places. Collective.
  BalloonState initial_state() const;

  // One step of length h from `state.time`, which stays where it is until the step has been ended; the caller restores
  // the state when the step did not converge. A step is begun, brought into balance by an Equilibrium, alone or with
  // what it touches or is linked to, and ended. Collective.

  InflateStep begin(BalloonState& state, double h);
  StepPart* part() override { return &*step_; }
  std::string stage() const override { return "implicit step"; }
  GasFilled* gas() override { return chambers_.count() > 0 ? &*step_ : nullptr; }
  std::string start_fault() const override { return bodies_.start_fault(); }
  ContactSurface::Part contact_part() const override {
    return {&membrane_, options_.contact.thickness, options_.contact.stiffness.value_or(usual_stiffness_)};
  }
  const std::vector<bool>* living() const override {
    return state_->burning ? &state_->burning->living.triangles : nullptr;
  }
  std::vector<bool> held() const override;
  /// @param step what `begin` has said @param balance how the balance was found
  void end(BalloonState& state, const EquilibriumResult& balance, InflateStep& step);

  /// Makes what follows from the other fields of a state that no step has left so. To be called before the first step
  /// of a state, which must outlive the steps. Collective.
  void follow(BalloonState& state);

  const std::vector<Body>& bodies() const { return bodies_.bodies(); }
  bool goes_by_arc_length() const { return integrator_.arc_length().has_value(); }
  bool burns() const { return burning_.has_value(); }
  bool can_crack() const { return cracks_.has_value(); }
  /// See Cracks::remark; empty if nothing can crack.
  std::string crack_remark() const { return cracks_ ? cracks_->remark() : ""; }
  double heat_capacity() const { return options_.heat.capacity; }   ///< [J/(kg K)]
  double loss_mass() const { return options_.ablation.loss_mass; }  ///< m^loss as a share of m^init
  const Options& options() const { return options_; }

  const PrismElements& elements() const { return elements_; }
  const Chambers& chambers() const { return chambers_; }
  const std::vector<double>& mass() const { return mass_; }
  /// Updates what follows from the positions of the state at time 0, in case they have changed. Collective.
  void follow_start(BalloonState& state) const;
  /// This rank's share of the energy with which the wall is bent [J]. Collective.
  double bending_energy(const BalloonState& state) const {
    return bending_ ? bending_->energy(state.position, state.thickness_ratio) : 0;
  }

  /// The names of the stages, for the clock.
  static const std::vector<std::string>& stage_names(bool burns = false);

 private:
  Inflate(const Membrane& membrane, const Options& options, StageClock& clock, Textures textures,
          const BalloonState* state);
  StageResult burn(BalloonState& state, double h, bool& has_burnt);
  bool crack(BalloonState& state);
  void add_work(BalloonState& state);
  double kinetic_energy(const Field& velocity) const;
  void begin_gas(BalloonState& state);
  std::string end_gas(BalloonState& state);
  void begin_contact(const BalloonState& state);
  void hold_what_has_left(BalloonState& state) const;
  void take_over(const BalloonState& state);
  void set_drag(const BalloonState& state, double share);
  StepStart start_of_step(const BalloonState& state) const;
  void begin_acceleration(BalloonState& state);
  double move_on(BalloonState& state) const;
  /// What the gas has at the state's positions and time; prescribed volumes keep their multipliers. Collective.
  void set_pressures(BalloonState& state) const;

  const Membrane& membrane_;
  const Options& options_;
  StageClock& clock_;
  Textures textures_;
  Wall wall_;
  std::vector<double> mass_;  ///< of the owned vertices at present [kg]
  PrismElements elements_;
  TimeIntegrator integrator_;
  Pins pins_;
  Constraints constraints_;
  Chambers chambers_;
  GasStep gas_step_;  ///< of their gas
  PointLoads loads_;
  double usual_stiffness_;  ///< of contact [Pa/m]
  BodyContact bodies_;
  std::optional<WallBending> bending_;  ///< unless the wall has none
  std::optional<StepPotential> step_;
  std::unique_ptr<VolumePreservation> volume_preservation_;  ///< if the wall's rule asks for it
  std::optional<Burning> burning_;                           ///< if the wall burns
  std::optional<Cracks> cracks_;                             ///< if the wall can crack
  std::unique_ptr<Potential> hold_;                          ///< if it burns: of the vertices that have left
  std::optional<AirDrag> air_;                               ///< if there is air
  GasHeat gas_heat_;                                         ///< of a wall that burns
  Field uneven_;                                             ///< forces of gas and air by their weight [N]
  Field between_;                                            ///< positions at which these are
  std::unique_ptr<Potential> lift_;                          ///< likewise, if they have any
  std::unique_ptr<Potential> drag_;                          ///< likewise: of its drag
  BalloonState* state_ = nullptr;                            ///< whose steps these are
  double h_ = 0;                                             ///< length of the step [s]
  Field start_;                                              ///< positions at the beginning of the step
  Field start_velocity_;                                     ///< likewise
};

}  // namespace world
}  // namespace pellicle
