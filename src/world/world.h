#pragma once

#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/stage_clock.h"
#include "state/hdf5_file.h"
#include "world/group.h"
#include "world/object.h"
#include "world/run_plan.h"

namespace pellicle::world {

/// Objects with a common clock, which step together: either all of them accept a step, or none does. A world writes
/// nothing. All calls are collective over the communicator of the objects.
class World {
 public:
  /// @param objects at least one @param groups each object in one of them
  /// @throws Error on links between objects whose gas or air differs, and on surfaces that cross at the start
  World(std::vector<std::unique_ptr<Object>> objects, const std::vector<GroupPlan>& groups);
  /// The objects of a run at time 0, with the meshes that their options name. @throws Error on bad input, as a run does
  World(MPI_Comm comm, std::deque<NamedOptions> objects) : World(comm, plan_run(std::move(objects))) {}

  const std::vector<std::unique_ptr<Object>>& objects() const { return objects_; }
  /// @throws std::logic_error if there is none of this name
  Object& object(const std::string& name);
  const std::vector<std::unique_ptr<Group>>& groups() const { return groups_; }
  MPI_Comm comm() const { return objects_.front()->surface().comm(); }
  /// The clocks of all stages, with the names of the objects that they belong to.
  std::vector<std::pair<std::string, const StageClock*>> clocks() const;

  double time() const;                                                ///< [s]
  int steps() const;                                                  ///< accepted steps
  double& length() { return objects_.front()->state().next_length; }  ///< of the next step [s]; 0: not known yet

  /// Makes a step of length h [s] and accepts it; undoes it where it does not converge.
  StepResult step(double h);

  // The parts of `step`, for callers that decide themselves whether a step is accepted.

  /// Keeps a copy of the state.
  void keep();
  /// Tries a step of length h [s]. If it does not converge, time and number of steps stay and the rest of the state may
  /// be anything.
  StepResult advance(double h);
  /// Accepts the step that was tried, at a time that differs from time() by rounding alone.
  void accept(double time);
  /// Restores the state that `keep` has copied.
  void restore();

  /// Why no further step can be made; empty as long as one can.
  std::string ended() const;
  /// Whether an object took part in the last step: one of which nothing is left stays where it was.
  bool is_present(const Object& object) const { return object.state().step == steps(); }
  /// Lines for the start of the run's log.
  std::vector<std::string> first_remarks() const;
  /// Lines about the run as a whole for the end of the log.
  std::vector<std::string> remarks() const;
  /// Writes all objects. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;

 private:
  World(MPI_Comm comm, const RunPlan& plan);

  std::vector<std::unique_ptr<Object>> objects_;
  std::vector<std::unique_ptr<Group>> groups_;
};

}  // namespace pellicle::world
