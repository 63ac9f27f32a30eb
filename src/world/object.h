#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/stage_clock.h"
#include "contact/crack_faces.h"
#include "equilibrium/equilibrium.h"
#include "io/frame_writer.h"
#include "io/texture.h"
#include "state/hdf5_file.h"
#include "surface/mesh_rows.h"
#include "surface/surface.h"
#include "world/chain.h"
#include "world/options.h"
#include "world/run_plan.h"
#include "world/stage.h"
#include "world/state.h"

namespace pellicle::world {

/// A line about an event in the course of an object.
struct News {
  std::string line;
  bool is_figure = false;  ///< for a person who watches
};

/// An object of a world: a surface, the fields of its state, and the stages of its steps. A step is begun, its motion
/// is brought into balance, alone or with those of the objects that it touches or whose chambers are linked to its own,
/// and it is ended. Where cracks separate the surface its vertices are split after the step, unless that opens a
/// chamber which needs a closed surface, and so ends the object. All calls are collective unless stated otherwise.
class Object {
 public:
  /// An object at time 0. @param name empty: the run has one object @param rows of its mesh, of its shares on all ranks
  /// @throws Error on bad input, also if the object starts inside a body
  Object(std::string name, Options options, MPI_Comm comm, MeshRows rows);
  /// The object from a checkpoint.
  Object(std::string name, Options options, const Hdf5File& checkpoint);
  Object(const Object&) = delete;  // Its stages point to its options and its clock.
  Object& operator=(const Object&) = delete;

  const std::string& name() const { return name_; }
  const Options& options() const { return options_; }
  State& state() { return *state_; }
  const State& state() const { return *state_; }
  const Surface& surface() const { return *surface_; }
  StageClock& clock() { return clock_; }
  const StageClock& clock() const { return clock_; }
  MotionStage& motion() { return *stages_.motion; }
  const MotionStage& motion() const { return *stages_.motion; }
  /// Null: the object has no chambers.
  const Chambers* chambers() const { return stages_.gas != nullptr ? &stages_.gas->chambers() : nullptr; }

  /// Adds a stage to those before the motion and its gas. Fields of its own must have been added to the state, which
  /// keeps, moves and saves them. @throws Error as the maker does
  void add_stage(StageMaker make);
  /// A field on the particles, by its name in frames and checkpoints. Not collective. @throws std::logic_error if there
  /// is none
  Field& field(const std::string& name);

  /// Begins a step of length h [s]. When a step does not converge, time and step stay and the rest of the state may be
  /// anything.
  StageResult begin(double h);
  /// Ends the step that has begun. @param balance how the balance was found
  StageResult end(const EquilibriumResult& balance);
  /// The figures of the stages in the last step. Not collective.
  const Step& last_step() const { return step_; }
  /// How often the stages have been replaced by others, because particles or chambers were numbered anew. Not
  /// collective.
  int replaced() const { return replaced_; }
  /// The step is accepted and will not be undone. Moves the clock to `time`, by rounding alone: sums of steps drift.
  void accept(double time);
  /// Keeps a copy of the state.
  void keep();
  /// Restores the state that `keep` has copied.
  void restore();

  /// Distributes the object over the ranks anew if contact takes much more work on one of them than on others. To be
  /// called from time to time after a step has been accepted. @param load see SurfaceContact::load
  void spread(const std::vector<double>& load);
  /// Faces of the cracks that separated the surface when the last step was accepted. Not collective.
  const std::vector<CrackFace>& fresh_crack_faces() const { return crack_faces_; }
  /// Starts the stages anew. Must be called when positions have changed at the start of a run.
  void start();

  /// Why the object cannot go on; empty as long as it can. Not collective.
  const std::string& ended() const { return ended_; }
  /// Whether it has ended because nothing is left of it: other objects go on without it. Not collective.
  bool is_gone() const { return state_->burning && state_->burning->pieces.present.empty(); }

  /// Passes the present frame to `write`.
  void draw(const std::function<void(const Frame&)>& write);
  /// The row of the history about the last step. @param retries how often it was tried again
  /// @param contact_apart its contact is in the table of the objects that it touches, not in its own
  Report report(int retries, bool contact_apart) const;
  /// Lines about the surface for a person who watches.
  std::vector<std::string> lines() const { return chain_->lines(*surface_); }
  /// Lines for the start of the run's log, such as that cells are too long.
  std::vector<std::string> first_remarks() const;
  /// Lines about the run as a whole for the end of the log, such as steps that ended out of balance.
  std::vector<std::string> remarks() const;
  /// Takes the lines about events since the last call, such as chambers that have opened. Not collective.
  std::vector<News> take_news() { return std::exchange(news_, {}); }

  /// Writes all that is needed to go on from the present state. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;

 private:
  std::string group() const { return "objects/" + (name_.empty() ? chain_->words.group : name_); }
  void make_stages();
  void update_derived();
  void split();
  void divide();
  void transfer(MovedSurface moved);
  void find_end();
  bool can_crack() const { return state_->burning && cracks_of(options_).strength.has_value(); }
  std::string at_step() const { return "step " + std::to_string(state_->step) + ": "; }

  std::string name_;
  const Options options_;
  std::unique_ptr<Chain> chain_;
  StageClock clock_;
  // The surface, and everything that depends on its numbering.
  std::shared_ptr<const Surface> surface_;
  Textures textures_;
  std::unique_ptr<State> state_;
  Stages stages_;
  std::vector<StageMaker> added_;      ///< see add_stage
  std::optional<FieldRegistry> kept_;  ///< of the present surface, to be restored
  std::optional<Drawing> whole_;       ///< of all of the surface
  Step step_;                          ///< the last one, or the one in progress
  int replaced_ = 0;
  std::string ended_;                   ///< see `ended`
  std::vector<CrackFace> crack_faces_;  ///< see `fresh_crack_faces`
  std::vector<News> news_;
};

}  // namespace pellicle::world
