#pragma once

#include <Eigen/Core>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/stage_result.h"
#include "contact/bodies.h"
#include "equilibrium/equilibrium.h"
#include "io/drawing.h"
#include "io/frame_writer.h"
#include "io/history.h"
#include "projection/successive_projection.h"
#include "surface/weave_strain.h"
#include "world/state.h"

namespace pellicle::world {

/// Mass, heat and temperature of a surface that burns, of all ranks.
struct FireFigures {
  double mass_left = 0;        ///< [kg]
  double mass_burnt = 0;       ///< since time 0 [kg]
  double heat_content = 0;     ///< [J]
  double heat_in = 0;          ///< since time 0 [J]
  double heat_out = 0;         ///< since time 0 [J]
  double heat_made = 0;        ///< by the umbrella operator since time 0 [J]
  double heat_initial = 0;     ///< at time 0 [J]
  double temperature_max = 0;  ///< of what is drawn [K]
};

/// A step of an object, and what its stages have found so far.
struct Step {
  double h = 0;  ///< length [s]; 0: there has been no step yet
  int heat_iterations = 0;
  int motion_iterations = 0;               ///< linear iterations of the motion
  int newton_iterations = 0;               ///< of a motion that is brought into balance
  EquilibriumResult balance;               ///< of the group that the object belongs to
  double constraint_error = 0;             ///< ||C|| of a sheet at the end [m]
  double force_residual = 0;               ///< of a sheet: norm of the sum of all forces over the largest kind of force
  PetscInt contacts = 0;                   ///< particles of this rank constrained by a body at the end
  std::vector<BodyLoad> loads;             ///< of the bodies, in the order of their names; empty: not known
  std::optional<double> error;             ///< estimated error over the object's size; none: no estimate
  PetscInt inverted = 0;                   ///< elements of a wall that have turned over, on all ranks
  std::optional<WeaveStrain> strain;       ///< of a sheet
  std::vector<ProjectionError> projected;  ///< ||C|| of each colour, if `project.monitor` asks for it
  std::optional<FireFigures> fire;         ///< of what burns
  bool has_burnt = false;                  ///< whether an element burnt away, on any rank
  bool has_cracked = false;                ///< whether a side of the elements cracked, on any rank
  std::vector<std::string> news;           ///< lines for the log, such as chambers that have opened
};

/// The result of a step that was tried. The same on every rank.
struct StepResult {
  bool converged = true;
  std::string reason;                  ///< in words, when it did not converge
  int iterations = 0;                  ///< linear iterations of all stages
  std::string figures{};               ///< further text of the progress line, such as "|C| 1.2e-05 m"
  std::optional<double> step_error{};  ///< estimated error, a fraction of the object's size; none: no estimate
  int newton_iterations = 0;
};

/// Named numbers of an object for the history, in the order in which they are added.
class Report {
 public:
  /// @param unit SI @param owner key of the option that gives the name; empty: the program
  void add(std::string name, std::string unit, double value, std::string owner = "") {
    columns_.push_back({std::move(name), std::move(unit), std::move(owner)});
    values_.push_back(value);
  }
  const std::vector<History::Column>& columns() const { return columns_; }
  const std::vector<double>& values() const { return values_; }

 private:
  std::vector<History::Column> columns_;
  std::vector<double> values_;
};

/// A frame of an object in the making: fields that stages derive, beside those of the state that frames show.
class Picture {
 public:
  Picture() = default;
  Picture(const Picture&) = delete;  // Its fields point into it.
  Picture& operator=(const Picture&) = delete;

  /// Draws this part of the surface in place of all of it.
  void cut(DrawnSurface drawn) { cut_ = std::move(drawn); }
  /// The part of the surface that is drawn; null: all of it.
  const DrawnSurface* drawn() const { return cut_ ? &*cut_ : nullptr; }
  /// Adds a field on the particles. @param values of the local ones
  void add_on_particles(const std::string& name, std::vector<double> values, bool is_of_both_layers = false) {
    frame_.particle_fields.push_back({name, 1, keep(std::move(values)), is_of_both_layers});
  }
  /// Adds a field on the elements. @param values (components x local)
  void add_on_cells(const std::string& name, std::vector<double> values, int components = 1) {
    frame_.cell_fields.push_back({name, components, keep(std::move(values))});
  }
  /// Draws springs as lines.
  void draw_springs(Drawing springs) { springs_ = std::move(springs); }
  /// Adds a field on the ends of springs. @param values (components x local)
  void add_on_spring_ends(const std::string& name, std::vector<double> values, int components = 1) {
    frame_.spring_ends.push_back({name, components, keep(std::move(values))});
  }
  /// Adds a field on the springs. @param values of the owned springs, colour after colour
  void add_on_springs(const std::string& name, std::vector<double> values) {
    frame_.spring_fields.push_back({name, 1, keep(std::move(values))});
  }

  /// The frame of a surface in a state. Collective.
  /// @param whole a drawing of all of the surface, which must outlive the frame: made if there is none and all is drawn
  const Frame& frame(const Surface& surface, const State& state, std::optional<Drawing>& whole);

 private:
  const double* keep(std::vector<double> values) { return kept_.emplace_back(std::move(values)).data(); }

  Frame frame_;
  std::deque<std::vector<double>> kept_;
  std::optional<DrawnSurface> cut_;
  std::optional<Drawing> cut_drawing_;
  std::optional<Drawing> springs_;
};

/// A part of each step of an object: a line of the list in which the burning paper writes a step (section 4), such as
/// heat, combustion, gas or motion. An object has a list of stages: a step begins all of them in their order, finds the
/// balance of the motion, and ends all of them in their order.
///
/// A stage works on the fields of the object's state and keeps nothing else from step to step: whenever the surface is
/// numbered anew all stages are made anew. All functions are collective.
class Stage {
 public:
  virtual ~Stage() = default;

  /// Sets the fields at time 0 that depend on positions; called again where contact has changed these (contact.start).
  virtual void start() {}
  /// Sets data that follow from the fields, when these have been read, restored or moved to other items.
  virtual void update_derived() {}
  /// The part of the stage before the balance; the time of the state is that of the beginning of the step. After a step
  /// that has not converged the state may be anything.
  virtual StageResult begin(Step& /*step*/) { return {}; }
  /// The part of the stage after the balance; the time of the state is still that of the beginning.
  virtual StageResult end(Step& /*step*/) { return {}; }

  /// Adds numbers for the history. @param step the last step
  virtual void report(Report& /*report*/, const Step& /*step*/) const {}
  /// Adds fields to a frame.
  virtual void draw(Picture& /*picture*/) const {}
  /// Lines for the start of the run's log, such as that cells are too long.
  virtual std::vector<std::string> first_remarks() const { return {}; }
  /// Lines about the run as a whole for the end of the log, such as the largest strain.
  virtual std::vector<std::string> remarks() const { return {}; }
};

/// Makes a stage of a program of one's own (Object::add_stage), now and whenever the surface has been numbered anew.
/// Surface and state outlive the stage.
using StageMaker = std::function<std::unique_ptr<Stage>(const Surface& surface, State& state)>;

/// The acceleration [m/s^2] of a particle at a place [m] that moves with a velocity [m/s], at a time [s].
using Acceleration =
    std::function<Eigen::Vector3d(const Eigen::Vector3d& place, const Eigen::Vector3d& velocity, double time)>;
/// Heat by mass and time that something gets at a place [m] at a time [s]; negative: that it loses [W/kg].
using Heating = std::function<double(const Eigen::Vector3d& place, double time)>;

/// A stage that accelerates all particles at the beginning of a step: it adds h times the acceleration to the
/// velocities, from which the balance goes on. Steps of statics have no velocities and ignore it.
StageMaker accelerating(Acceleration acceleration);
/// A stage that heats all particles at the beginning of a step; the heat is in the balance of heat.
/// @param capacity c of the object, HeatOptions::capacity [J/(kg K)] @throws Error if the object has no temperatures
StageMaker heating(Heating power, double capacity);

/// The stage that moves an object. Between begin and end an Equilibrium finds the balance.
class MotionStage : public Stage, public Motion {
 public:
  /// Takes positions and works of the step from its balance, before the stages end.
  virtual StageResult take_balance(Step& step) = 0;
  /// Inertia of the owned particles [kg].
  virtual const double* mass() const = 0;
  /// Local particles that pins hold.
  virtual const std::vector<bool>& pinned() const = 0;
  /// Stress of each local element in the last step, [N/m], or [Pa] of a wall whose strength is a stress: see Cracks.
  virtual const std::vector<Eigen::Matrix3d>& stress() = 0;
  /// All bodies that the object may meet.
  virtual const std::vector<Body>& bodies() const = 0;
  /// Numbers of this step for the line of progress, such as "|C| 1.2e-05 m".
  virtual std::string progress(const Step& step) const = 0;
};

}  // namespace pellicle::world
