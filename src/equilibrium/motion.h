#pragma once

#include <string>
#include <vector>

#include "base/stage_result.h"
#include "contact/contact_surface.h"
#include "energies/step_part.h"
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

}  // namespace pellicle::equilibrium
