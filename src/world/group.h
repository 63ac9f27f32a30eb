#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/stage_clock.h"
#include "equilibrium/equilibrium.h"
#include "world/object.h"
#include "world/run_plan.h"
#include "world/stage.h"

namespace pellicle::world {

/// The objects of a GroupPlan, which step together. All calls are collective.
class Group {
 public:
  /// @param objects of the plan, which must outlive the group; the clock of a single one measures its balance
  /// @throws Error on links between objects whose gas or air differs
  Group(GroupPlan plan, std::vector<Object*> objects);

  /// Makes a step of length h [s] of all objects that are not gone. @param all result of the groups before,
  /// to which that of this one is added
  void advance(double h, StepResult& all);
  /// Must be called when all objects of the run have accepted a step (Object::accept).
  void accept();

  const GroupPlan& plan() const { return plan_; }
  /// The row of the table about the contact of several objects with each other.
  Report report() const;
  /// Lines for the start of the run's log: surfaces that cross at the start, and the linear solver.
  std::vector<std::string> first_remarks();
  /// The clock of the common steps of several objects; null for a single object.
  StageClock* clock() { return plan_.is_single() ? nullptr : &clock_; }

 private:
  std::vector<Object*> present() const;
  std::vector<Object*> touching() const;
  Equilibrium* equilibrium();

  GroupPlan plan_;
  std::vector<Object*> objects_;
  StageClock clock_;
  std::string start_line_;
  std::vector<std::pair<const Object*, int>> numbering_;  ///< what is not gone, and Object::replaced
  std::unique_ptr<Equilibrium> equilibrium_;              ///< of these; null: nothing is left
  EquilibriumResult last_;
};

/// Counts crossings and acts as `contact.start` says: only counts, or refuses surfaces that pass through themselves or
/// each other, or moves them until they do not (contact/untangle.h), and then apart until they hardly press.
/// Collective.
/// @returns a message; empty: nothing crossed
/// @throws Error naming objects, elements and place, if crossings are refused or cannot be removed, and if a thickness
/// is more than ten mean sides of its mesh
std::string settle_start(const ContactOptions& options, const std::vector<Object*>& objects);

}  // namespace pellicle::world
