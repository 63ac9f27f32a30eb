#pragma once

#include <algorithm>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/stage_clock.h"
#include "contact/surface_contact.h"
#include "equilibrium/implicit_step.h"
#include "io/history.h"
#include "solvers/step_objective.h"
#include "world/object.h"
#include "world/options.h"

namespace pellicle {
inline namespace world {

/// Which objects touch each other or are linked by their gas, and how their common step is solved.
struct TogetherOptions {
  std::vector<std::size_t> objects;  ///< which, by their places in the run
  std::vector<std::string> names;    ///< of them
  std::vector<bool> touches;         ///< whether they touch themselves and each other
  ContactOptions contact;
  PrismOptions step;

  bool any_touches() const { return std::find(touches.begin(), touches.end(), true) != touches.end(); }
};

/// Objects of a run with `contact.self` touch each other, and links (share_links) join chambers of several: their
/// options are told that they are brought into balance together (ContactOptions::together), unless they are sheets that
/// are not elastic and are linked alone.
/// @returns nothing unless there are at least two @throws Error when they are to touch in different ways, or are linked
/// and balance forces at different times in a step
std::optional<TogetherOptions> find_together(std::deque<ObjectOptions>& objects);

/// Objects that touch themselves and each other, or whose chambers are linked: a step brings all of them into balance
/// at once, so that what one presses on another presses back, and gas flows by the pressures at the step's end. Sheets
/// that are not elastic enter it where they touch others as masses at the places to which they have been projected
/// (MassPart); where they are linked, by how far a pressure pushes them (FlowingGas::Response), and move by the
/// pressures that come out; both again if they have not moved so far. All calls are collective.
class Together {
 public:
  /// @param objects all of the run; must outlive it
  /// @throws Error on links between objects whose gas or air differs
  Together(TogetherOptions options, const std::vector<Object*>& objects, OutputFolder& folder);

  /// Whether an object of the run takes part.
  bool has(const Object* object) const;

  /// See Object::advance, of all that take part and are not gone.
  StepResult advance(double h);
  /// See Object::accept, when all objects have accepted.
  void accept();
  /// See Object::forget.
  void forget() { numbering_.clear(), step_ = nullptr; }

  /// Adds a row to contacts.csv, if any of them touch.
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

  /// See settle_start; empty where nothing crossed.
  const std::string& start_line() const { return start_line_; }
  /// Which linear solver it has, and of what; empty where nothing is brought into balance.
  std::string solver_words();
  /// Of its common steps.
  const StageClock& clock() const { return clock_; }
  StageClock& clock() { return clock_; }

 private:
  /// The step of some surfaces, until their numbering changes.
  struct Step {
    /// @param contact null: nothing touches
    Step(const std::vector<StepPart*>& parts, std::unique_ptr<SurfaceContact> contact, const TogetherOptions& options);

    std::unique_ptr<SurfaceContact> contact;
    StepObjective objective;
    ImplicitStep solver;
  };

  std::vector<TouchingObject*> present() const;
  std::vector<TouchingObject*> with_parts() const;
  bool touches(const Object* object) const;
  Step* common();
  void share_gas();
  StepResult balance(double h);
  const std::string& name_of(const Object* object) const;
  std::string crossed();
  void count_contact();
  std::string what() const { return options_.any_touches() ? "touches" : "is linked"; }

  TogetherOptions options_;
  std::vector<TouchingObject*> objects_;
  StageClock clock_;
  std::string start_line_;
  std::vector<std::pair<const TouchingObject*, int>> numbering_;  ///< what is not gone, and TouchingObject::replaced
  std::unique_ptr<Step> step_;                                    ///< of these; null: none of them has a part
  ImplicitResult last_;
  std::optional<ContactFigures> figures_;  ///< at the end of the last step
  std::unique_ptr<History> history_;       ///< null: nothing touches
};

}  // namespace world
}  // namespace pellicle
