#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/stage_clock.h"
#include "contact/lips.h"
#include "equilibrium/equilibrium.h"
#include "io/console.h"
#include "io/frame_writer.h"
#include "io/output_folder.h"
#include "state/hdf5_file.h"
#include "surface/surface.h"
#include "world/object_state.h"

namespace pellicle {
inline namespace world {

/// The result of a step that was tried, of an object or of the whole world. The same on every rank.
struct StepResult {
  bool converged = true;
  std::string reason;                  ///< in words, when it did not converge
  int iterations = 0;                  ///< linear iterations of all stages
  std::string figures{};               ///< further text of the progress line, such as "|C| 1.2e-05 m"
  std::optional<double> step_error{};  ///< estimated error of the step, a share of the object's size; none: no estimate
  int newton_iterations = 0;
};

/// The name of an object as the beginning of a line: "cloth: "; "" of one without a name.
inline std::string heading_of(const std::string& object) { return object.empty() ? "" : object + ": "; }

/// The key of an object in a deck: "objects.cloth"; "" of one without a name.
inline std::string key_of(const std::string& object) { return object.empty() ? "" : "objects." + object; }

/// Where an object's output goes. All must outlive the object.
struct ObjectOutput {
  OutputFolder& folder;
  Console& console;
  StageClock& clock;
  std::string object;          ///< its name; empty: the run has one object, without a name
  bool contact_apart = false;  ///< its contact is in the table of the objects that it touches, not in its own

  /// "history_cloth.csv" of "history".
  std::string table(const std::string& name) const { return name + (object.empty() ? "" : "_" + object) + ".csv"; }
  std::string heading() const { return heading_of(object); }
  /// Its group in a checkpoint: "objects/cloth". @param kind that stands for the name where there is none
  std::string group(const std::string& kind) const { return "objects/" + (object.empty() ? kind : object); }
};

/// Runs `work` on behalf of an object. @throws Error as `work` does, with the object's name before it
/// @param heading see heading_of
template <class Work>
auto about_object(const std::string& heading, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    throw Error(heading + error.what());
  }
}

/// Receives a frame of an object. @returns whether it has become one of the frames of the run
using FrameSink = std::function<bool(const Frame&)>;

/// An object of a world: its stages together with their state. A step is begun, its motion is brought into balance,
/// alone or with those of the objects that it touches or whose chambers are linked to its own, and it is ended. All
/// calls are collective.
class Object {
 public:
  virtual ~Object() = default;

  /// All that changes from step to step.
  virtual ObjectState& state() = 0;
  const ObjectState& state() const { return const_cast<Object&>(*this).state(); }

  /// Begins a step of length h [s]. When a step does not converge, time and step stay and the rest of the state may be
  /// anything.
  virtual StepResult begin(double h) = 0;
  /// Of the step that has begun.
  virtual Motion& motion() = 0;
  /// The surface of which triangles are drawn.
  const Surface& surface() { return *motion().contact_part().surface; }
  /// The rest of the step. @param balance how the balance was found
  virtual StepResult end(const EquilibriumResult& balance) = 0;
  /// How often motion, gas and surface have been replaced by others, because particles or chambers were numbered anew.
  int replaced() const { return replaced_; }
  /// The step is accepted and will not be undone. Moves the clock to `time`, by rounding alone: sums of steps drift.
  virtual void accept(double time) = 0;
  /// Keeps a copy of the state ...
  virtual void keep() = 0;
  /// ... and restores it.
  virtual void restore() = 0;

  /// Now and then when a step has been accepted: spreads itself over the ranks anew if contact has much more to do with
  /// it on one of them than on others. @param load see SurfaceContact::load; empty: there is no contact
  virtual void spread(const std::vector<double>& /*load*/) {}
  /// Lips of the cracks that separated the surface when the last step was accepted.
  virtual const std::vector<Lip>& fresh_lips() const = 0;
  /// To be called when positions have changed at the start of a run: updates what follows from them.
  virtual void follow_start() = 0;

  /// Why the object cannot go on; empty as long as it can.
  virtual std::string ended() const { return ""; }
  /// Whether it has ended because nothing is left of it: other objects go on without it.
  virtual bool is_gone() const { return false; }

  /// Passes the present frame to `write`.
  virtual void draw(const FrameSink& write) = 0;
  /// Adds a row to the history, about the step of length h [s] that was accepted after so many retries.
  virtual void record(double h, int retries) = 0;
  /// Lines about the object for the start of the run's log, such as which solver it has chosen.
  virtual std::vector<std::string> first_remarks() const { return {}; }
  /// Lines about the run as a whole for the end of the log, such as steps that ended out of balance.
  virtual std::vector<std::string> remarks() const { return {}; }

  /// Writes all that is needed to go on from the present state and behind the present output. @throws Error, on all
  /// ranks
  virtual void save(Hdf5File& checkpoint) const = 0;
  /// Continues the tables of the run that has written a checkpoint, in its folder, instead of writing the first row.
  /// @throws Error, on all ranks, when the folder lacks what the checkpoint names
  virtual void resume_output(const Hdf5File& checkpoint) = 0;

 protected:
  void note_replaced() { ++replaced_; }

 private:
  int replaced_ = 0;
};

}  // namespace world
}  // namespace pellicle
