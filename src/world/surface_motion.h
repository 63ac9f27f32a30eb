#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "air/air_drag.h"
#include "base/stage_clock.h"
#include "constraints/pins.h"
#include "contact/body_contact.h"
#include "equilibrium/gas_filled_part.h"
#include "equilibrium/path_part.h"
#include "equilibrium/time_scheme.h"
#include "world/gas_stage.h"
#include "world/options.h"
#include "world/stage.h"
#include "world/state.h"

namespace pellicle::world {

/// The common part of the motions of sheets and of walls: the step in progress, the drag of the air, and the parts
/// that are brought into balance.
class SurfaceMotion : public MotionStage {
 public:
  StepPart* part() override { return part_; }
  GasFilled* gas() override { return filled_ ? &*filled_ : nullptr; }
  const std::vector<bool>* active() const override { return state_.active_triangles(); }
  const std::vector<bool>& pinned() const override { return pins_.pinned(); }
  std::string start_fault() const override {
    return body_contact_ != nullptr ? body_contact_->sweep().start_fault() : "";
  }
  const std::vector<Body>& bodies() const override;
  ContactSurface::Part contact_part() const override { return {&surface_, options_.contact.thickness, stiffness_}; }

 protected:
  /// All must outlive it. Collective. @param gas of its chambers; null: it has none
  SurfaceMotion(const Surface& surface, const Options& options, State& state, StageClock& clock, GasStage* gas,
                const TimeIntegrator& integrator);

  /// Balances a part, with the gas if there is any, and by arc length along the path. Collective.
  /// @param mass of the owned particles, at least @param set_time changes the time of the loads on the part [s]
  /// @param set_load see GasFilledPart
  void set_part(StepPart& part, const std::vector<double>& mass, std::function<void(double)> set_time,
                GasFilledPart::SetLoad set_load = {});
  /// Makes the bodies whose pressing is balanced, if there are any. To be called once, at construction. Collective.
  /// @param usual_stiffness of contact, unless contact.stiffness is given [Pa/m]
  void set_contact(double usual_stiffness);
  /// Begins the step of bodies whose pressing is balanced. Collective. @param held local particles that do not move
  /// @param time at which forces are in balance [s] @param h length of the step until then [s]
  void begin_bodies(const std::vector<bool>& held, double time, double h);
  /// Begins the step of gas and path, after that of the part. Collective. @param time_of_balance [s]
  void begin_gas_and_path(double time_of_balance);
  /// Writes x^{n+1}, which follows from x (TimeIntegrator), with pinned particles in their places; ghosts up to date.
  virtual void write_end(Field& position) const;
  /// Keeps the end of the step on the path, if there is one, for the next step. Collective.
  void end_path();
  /// Sets the drag of the air, if there is any, in the step. Collective.
  /// @param fraction of the step at which forces are in balance
  void set_drag(double fraction);
  /// Time of the loads at the end of the step [s].
  double end_of_loads() const { return state_.time_of_loads() + integrator_.load_step(h_); }
  /// Time of the loads at which forces are in balance [s].
  double time_of_balance() const { return state_.time_of_loads() + integrator_.fraction() * integrator_.load_step(h_); }
  /// Velocity and acceleration of a local particle at the beginning of the step.
  Kinematics start_of(PetscInt i) const;
  /// Finds velocities, and accelerations if they count, from the positions before and after the step, in which by an
  /// integrator of second order what is held moves evenly. @returns the largest error of this rank's particles [m]
  double find_end(const std::vector<bool>& held);
  /// Moves what has left back to exactly where it was, whatever pulls at it, unless it `is_carried`.
  void keep_what_has_left();
  bool has_left(PetscInt i) const { return state_.burning && state_.burning->mass.data()[i] == 0; }
  /// Whether a local particle that has left moves along with the rest of its quad.
  virtual bool is_carried(PetscInt /*i*/) const { return false; }
  /// The result of a step with a fault at its end; a fault of its start explains it. Empty: there is none. Collective.
  StageResult result_of(std::string fault) const;
  /// Lets the surface rebound from bodies, with its work. Collective. @param loads see BodyContact::rebound
  void rebound(std::vector<BodyLoad>& loads);
  /// The potentials of a list that are not null.
  static std::vector<Potential*> present(const std::vector<Potential*>& potentials);

  const Options& options_;
  State& state_;
  StageClock& clock_;
  GasStage* gas_;
  TimeIntegrator integrator_;
  Pins pins_;
  std::optional<AirDrag> air_;                 ///< if there is air
  double stiffness_ = 0;                       ///< of contact in the present step [Pa/m]
  std::unique_ptr<BodyContact> body_contact_;  ///< bodies whose pressing is brought into balance; null: there are none
  std::optional<GasFilledPart> filled_;        ///< if there are chambers
  std::optional<PathPart> path_;               ///< by arc length
  StepPart* part_ = nullptr;                   ///< with gas and along the path
  // The present step.
  double h_ = 0;              ///< its length [s]
  Field start_;               ///< positions at the beginning [m]
  Field start_velocity_;      ///< [m/s]
  std::vector<double> mass_;  ///< inertia of the owned particles; of a sheet of the local ones [kg]

 private:
  const Surface& surface_;
};

}  // namespace pellicle::world
