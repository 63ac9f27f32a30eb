#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/stage_clock.h"
#include "io/texture.h"
#include "parallel/records.h"
#include "state/hdf5_file.h"
#include "surface/mesh_rows.h"
#include "surface/split_corners.h"
#include "surface/surface.h"
#include "world/gas_stage.h"
#include "world/options.h"
#include "world/stage.h"
#include "world/state.h"

namespace pellicle::world {

/// A surface that was made from another one, with the data of its local particles and elements, ghosts up to date.
struct MovedSurface {
  std::shared_ptr<const Surface> surface;
  Records particles;
  Records elements;
};

/// The stages of an object in the order of a step, and those that others ask.
struct Stages {
  std::vector<std::unique_ptr<Stage>> all;
  MotionStage* motion = nullptr;
  GasStage* gas = nullptr;  ///< null: the object has no chambers

  template <class Kind>
  Kind& add(std::unique_ptr<Kind> stage) {
    Kind& added = *stage;
    all.push_back(std::move(stage));
    return added;
  }
  template <class Kind, class... Arguments>
  Kind& add(Arguments&&... arguments) {
    return add(std::make_unique<Kind>(std::forward<Arguments>(arguments)...));
  }
  /// Adds a stage before the motion, and before its gas if it has any.
  Stage& add_before_motion(std::unique_ptr<Stage> stage) {
    const auto place = std::find_if(all.begin(), all.end(), [this](const std::unique_ptr<Stage>& other) {
      return other.get() == gas || other.get() == motion;
    });
    return **all.insert(place, std::move(stage));
  }
};

/// Names that a kind of object has in clocks, in the log and in checkpoints.
struct ChainWords {
  std::vector<std::string> clock_names;  ///< of the parts of a step that the clock of an object measures
  std::string renumbering;               ///< the one of them that is the renumbering of the surface
  std::string end;                       ///< a line for an object that has ended because nothing is left of it
  std::string group;                     ///< stands for an object without a name in a checkpoint
};

/// The kind of an object (`chain`): how its surface is made, renumbered and kept in checkpoints, and of which stages
/// its steps consist. It has no state. All functions are collective unless stated otherwise.
class Chain {
 public:
  /// The options must outlive it. Not collective.
  Chain(const Options& options, ChainWords words) : words(std::move(words)), options_(options) {}
  virtual ~Chain() = default;

  /// Lines about a surface for a person who watches.
  virtual std::vector<std::string> lines(const Surface& surface) const = 0;

  /// Distributes a surface. @throws Error, on all ranks, on bad materials of a wall that burns
  virtual std::shared_ptr<const Surface> make_surface(MPI_Comm comm, MeshRows rows) const = 0;
  /// Reads a surface from the group of its object in a checkpoint. @throws Error, on all ranks
  virtual std::shared_ptr<const Surface> read_surface(const Hdf5File& checkpoint, const std::string& group) const = 0;
  /// Writes a surface into the group of its object. @throws Error, on all ranks
  virtual void write_surface(Hdf5File& checkpoint, const std::string& group, const Surface& surface) const = 0;

  /// Splits corners of a surface. @param particles, copies, elements data of these, see `split` of surface/shell.h
  virtual MovedSurface split(const Surface& surface, const SplitCorners& corners, const Records& particles,
                             const Records& copies, const Records& elements) const = 0;
  /// Removes empty elements from a surface; none: there are too few of them.
  virtual std::optional<MovedSurface> compact(const Surface& /*surface*/, const State& /*state*/) const { return {}; }
  /// Distributes a surface anew by the load of contact; none: the load is even enough. @param load of the particles
  virtual std::optional<MovedSurface> spread(const Surface& /*surface*/, const State& /*state*/,
                                             const std::vector<double>& /*load*/) const {
    return {};
  }

  /// The state at time 0, with the initial noise and the particles that pins, loads and chambers choose; the stages set
  /// the rest (Stage::start). @throws Error on bad pins, planes, loads and chambers
  virtual std::unique_ptr<State> initial_state(const Surface& surface) const = 0;
  /// The stages of an object that goes on from a state. All must outlive them.
  /// @throws Error on textures that cannot be read and other input
  virtual Stages make_stages(const Surface& surface, State& state, StageClock& clock, Textures& textures) const = 0;

  const ChainWords words;

 protected:
  const Options& options_;
};

/// The chain of the burning paper: a sheet of quads heats, burns, shrinks and is cut, moves and cracks; it may enclose
/// gas. Elements that have burnt away are removed from it now and then, see `ablation.compact_fraction`.
std::unique_ptr<Chain> make_sheet_chain(const Options& options);
/// The chain of the balloon paper: a wall of triangles with thickness encloses gas and moves; it heats, burns, is cut
/// and cracks where something heats or strains it (balloon_burns).
std::unique_ptr<Chain> make_wall_chain(const Options& options);
/// The chain that options ask for, which must outlive it. Not collective.
inline std::unique_ptr<Chain> make_chain(const Options& options) {
  return options.chain == ChainKind::inflate ? make_wall_chain(options) : make_sheet_chain(options);
}

}  // namespace pellicle::world
