#pragma once

#include <algorithm>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/stage_clock.h"
#include "equilibrium/equilibrium.h"
#include "io/history.h"
#include "world/object.h"
#include "world/options.h"

namespace pellicle {
inline namespace world {

/// The plan of a group: the objects of a run that are brought into balance together, because they touch each other or
/// their chambers are linked, and how that is done. An object that does neither is a group of its own.
struct GroupPlan {
  std::vector<std::size_t> objects;  ///< which, by their places in the run
  std::vector<std::string> names;    ///< of them
  std::vector<bool> touches;         ///< whether they touch themselves and each other
  ContactOptions contact;
  NewtonOptions newton;

  bool any_touches() const { return std::find(touches.begin(), touches.end(), true) != touches.end(); }
  bool is_single() const { return objects.size() == 1; }
  /// Says who touches whom, such as "cloth, ball: touch each other"; empty for a single object.
  std::string words() const;
};

/// Of a single object.
GroupPlan plan_of(const std::string& name, const Options& options);
/// The groups of a run, each object in one of them: objects with `contact.self` touch each other, and links
/// (share_links) join chambers of several.
/// @throws Error when objects are to touch in different ways, are linked and balance forces at different times in a
/// step, or cannot be brought into balance with others
std::vector<GroupPlan> plan_groups(const std::deque<ObjectOptions>& objects);

/// The objects of a GroupPlan, which step together. All calls are collective.
class Group {
 public:
  /// @param objects of the plan, with their clocks, which measure the balance of a single one; must outlive the group
  /// @throws Error on links between objects whose gas or air differs
  Group(GroupPlan plan, std::vector<std::pair<Object*, StageClock*>> objects, OutputFolder& folder);

  /// Makes a step of length h [s] of all objects that are not gone.
  StepResult advance(double h);
  /// See Object::accept, when all objects of the run have accepted.
  void accept();

  /// Adds a row to contacts.csv, if several objects touch.
  void record(double time, int step);
  void save(Hdf5File& checkpoint) const {
    if (history_ != nullptr) {
      history_->save(checkpoint);
    }
  }
  void resume_output(const Hdf5File& checkpoint) {
    if (history_ != nullptr) {
      history_->resume(checkpoint);
    }
  }

  /// Lines for the start of the run's log: what crossed at the start, which linear solver there is.
  std::vector<std::string> first_remarks();
  /// Of its common steps, where there are several objects; else null.
  StageClock* clock() { return plan_.is_single() ? nullptr : &clock_; }

 private:
  std::vector<std::size_t> present() const;
  Equilibrium* equilibrium();
  std::string heading(std::size_t i) const { return heading_of(plan_.names[i]); }

  GroupPlan plan_;
  std::vector<Object*> objects_;
  StageClock clock_;
  StageClock* clock_of_balance_;
  std::string start_line_;
  std::vector<std::pair<const Object*, int>> numbering_;  ///< what is not gone, and Object::replaced
  std::unique_ptr<Equilibrium> equilibrium_;              ///< of these; null: nothing is left
  EquilibriumResult last_;
  std::unique_ptr<History> history_;  ///< null: there is no other object to touch
};

}  // namespace world
}  // namespace pellicle
