#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/stage_clock.h"
#include "base/stage_result.h"
#include "contact/surface_contact.h"
#include "energies/newton_options.h"
#include "energies/step_objective.h"
#include "equilibrium/implicit_step.h"
#include "equilibrium/step_gas.h"

namespace pellicle::equilibrium {

/// The motion of an object in a step, between its begin and its end: what an Equilibrium brings into balance, or what
/// moves by itself and answers the balance of the others. All calls are collective unless stated otherwise.
class Motion {
 public:
  virtual ~Motion() = default;

  /// The part of the step that is brought into balance; null: the object moves by itself.
  virtual StepPart* part() = 0;
  /// The gas in its chambers; null: it has none.
  virtual GasFilled* gas() = 0;

  /// The stage of the object's clock in which its balance counts. Not collective.
  virtual std::string stage() const = 0;

  /// Before `move`, of all objects that move by themselves: takes the pressures of the gas in the last balance.
  virtual void choose_pressures() {}
  /// After a balance: moves an object that moves by itself, or lets a constraint of one that was balanced act again.
  /// @param is_done set to false if the balance has to be found once more
  virtual StageResult move(bool& /*is_done*/) { return {}; }

  /// Describes a fault of the step's start because of which a balance may not be found; empty: there is none.
  virtual std::string start_fault() const = 0;

  /// Names the limit on the object that is passed where Newton's method has given up; empty: none.
  virtual std::string passed_limit() const { return ""; }

  // How its drawn surface touches others. Not collective.

  virtual ContactSurface::Part contact_part() const = 0;
  /// Flags of the surface triangles of the object: false where one has burnt away. Null: all triangles are there.
  virtual const std::vector<bool>* active() const = 0;
  /// Local particles that are not free in all directions.
  virtual std::vector<bool> constrained() const = 0;
};

/// An object of an Equilibrium.
struct CoupledMotion {
  std::string name;  ///< of the object; empty: the run has one object, without a name
  Motion* motion;
  bool touches = false;  ///< whether it touches itself and the others that do
};

/// How the balance of a step was found.
struct EquilibriumResult : ImplicitResult {
  int moving_iterations = 0;              ///< linear iterations of the objects that move by themselves
  std::optional<ContactFigures> contact;  ///< at the end of the step; none: nothing touches
  std::vector<ContactWork> contact_work;  ///< of each object in the step; empty: nothing touches
};

/// The balance of one object, or of several that touch each other or whose chambers are linked: a step brings all of
/// them into balance at once, so that what one presses on another presses back, and gas flows by the pressures at the
/// end of the step.
///
/// Projected sheets enter it where they touch something as masses at the places to which they have been projected
/// (MassPart); where they have gas, by how far a pressure pushes them (FlowingGas::Response), and move by the pressures
/// that come out; both again until these agree. All calls are collective.
class Equilibrium {
 public:
  /// @param objects at least one; their motions must outlive it, with the same numbering of particles and chambers
  /// @param clock, stage which measure the balance
  /// @throws Error on solver options that PETSc does not know, and on links between objects whose gas or air differs
  Equilibrium(std::vector<CoupledMotion> objects, const ContactOptions& contact, const NewtonOptions& options,
              StageClock& clock, const std::string& stage);
  Equilibrium(const Equilibrium&) = delete;  // Its solver points to its objective.
  Equilibrium& operator=(const Equilibrium&) = delete;

  /// Brings the step of length h [s], which all objects have begun, into balance. The reason of a failure names the
  /// object if there are several. @param factorised of the step before; is set to that of this one
  EquilibriumResult solve(double h, FactorisedSteps& factorised);

  /// Describes its linear solver, such as "cg, mg with rigid patches"; empty: nothing is brought into balance.
  std::string solver_words() const { return solver_ ? solver_->solver_words() : ""; }
  /// Null: nothing touches.
  const SurfaceContact* contact() const { return contact_.get(); }
  /// How much contact has to do with each owned particle of an object, see SurfaceContact::load; empty: it touches
  /// nothing.
  std::vector<double> contact_load(const Motion& motion) const;

 private:
  void share_gas();
  ImplicitResult balance(double h, FactorisedSteps& factorised);
  std::string crossed() const;
  void count_contact(EquilibriumResult& result) const;
  std::string heading(const CoupledMotion& object) const { return object.name.empty() ? "" : object.name + ": "; }

  std::vector<CoupledMotion> objects_;
  std::vector<CoupledMotion> balanced_;  ///< those that have a part
  StageClock& clock_;
  std::string stage_;
  std::unique_ptr<SurfaceContact> contact_;   ///< null: nothing touches
  std::unique_ptr<StepObjective> objective_;  ///< null: nothing is brought into balance
  std::unique_ptr<ImplicitStep> solver_;      ///< null: nothing is brought into balance
};

}  // namespace pellicle::equilibrium
