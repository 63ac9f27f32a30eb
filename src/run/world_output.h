#pragma once

#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "geometry/solids.h"
#include "io/console.h"
#include "io/frame_series.h"
#include "io/frame_writer.h"
#include "io/history.h"
#include "io/output_folder.h"
#include "run/step_control.h"
#include "state/hdf5_file.h"
#include "world/world.h"

namespace pellicle::run {

/// A body or a ball of heat as frames show it.
struct BodyDrawing : FramePart {  // "ball", "heat_flame", of an object "heat_paper_flame"
  Shape shape;
  RigidMotion motion;
  double from = 0;                                      ///< time at which it appears [s]
  double to = std::numeric_limits<double>::infinity();  ///< time at which it disappears [s]
};

/// The bodies of a run, and the balls of heat of all its objects. Collective. @throws Error as make_bodies does
/// @param objects the first has the run's bodies
std::vector<BodyDrawing> drawings_of_bodies(MPI_Comm comm, const std::deque<NamedOptions>& objects);

/// The tables of an object: a row of history.csv for the initial state and for each step, where something burns the
/// pieces of each frame in pieces.csv, and with `project.monitor` the curves of Fig. 8 of the burning paper in
/// projection.csv. The tables of an object with a name have it in theirs. All calls are collective.
class HistoryTables {
 public:
  /// Touches no file. Folder and object must outlive it.
  /// @param contact_apart see Object::report
  /// @throws Error, the same on all ranks, if two columns, or two files, have the same name
  HistoryTables(OutputFolder& folder, Object& object, bool contact_apart);

  /// Adds the row of the last step. @param retries how often it was tried again
  void add_step(int retries);
  /// Adds a row for each piece of the present frame.
  void add_frame();

  /// Notes in a checkpoint how long the tables are. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;
  /// Goes on with the tables of the run that has written a checkpoint, in its folder. @throws Error, on all ranks
  void resume(const Hdf5File& checkpoint);

 private:
  Object& object_;
  bool contact_apart_;
  History history_;
  std::unique_ptr<History> pieces_;      ///< null: nothing burns
  std::unique_ptr<History> projection_;  ///< null: not asked for
};

/// The output of a world: frames, tables and lines. All calls are collective.
class WorldOutput : public SteppedRun {
 public:
  /// Touches no file. World, folder and console must outlive it. @param bodies that frames show beside the objects
  /// @throws Error if two objects or bodies would write the same file
  WorldOutput(World& world, OutputFolder& folder, Console& console, const OutputOptions& options,
              std::vector<BodyDrawing> bodies = {});

  World& world() { return world_; }

  /// Writes the first frame, which makes the folder, and the first rows. @throws Error, on all ranks, on chosen fields
  /// that no object has, before anything is written
  void begin();
  /// Continues the output of the run that has written a checkpoint, in its folder, instead. @throws Error, on all
  /// ranks, when the folder lacks files that the checkpoint names
  void resume(const Hdf5File& checkpoint);

  double time() const override { return world_.time(); }
  int step() const override { return world_.steps(); }
  double& length() override { return world_.length(); }
  StepResult advance(double h) override { return world_.advance(h); }
  void accept(double time) override { world_.accept(time); }
  void keep() override { world_.keep(); }
  void restore() override { world_.restore(); }
  std::string ended() const override { return world_.ended(); }
  std::vector<std::string> remarks() const override { return world_.remarks(); }
  bool frame_due() const override { return writer_.due(time(), step()); }
  std::optional<double> next_frame_time() const override { return writer_.next_time(time()); }
  void draw() override;
  std::string draw_failed(double h) override;
  void record(int retries) override;
  void save(Hdf5File& checkpoint) const override;

 private:
  void check_chosen_fields();
  void draw_bodies();
  void add_rows(int retries, bool all);

  World& world_;
  Console& console_;
  std::vector<BodyDrawing> bodies_;
  FrameWriter writer_;
  bool fields_are_to_be_checked_;
  std::deque<HistoryTables> tables_;   ///< of the objects
  const Group* touching_ = nullptr;    ///< several objects that touch each other; null: there are none
  std::unique_ptr<History> contacts_;  ///< their table
};

}  // namespace pellicle::run
