#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ablation/ablation_options.h"
#include "air/air_options.h"
#include "combustion/combustion.h"
#include "constraints/constraints.h"
#include "constraints/pins.h"
#include "constraints/point_loads.h"
#include "contact/bodies.h"
#include "contact/contact_surface.h"
#include "elastic/elastic_options.h"
#include "equilibrium/time_scheme.h"
#include "gas/gas_options.h"
#include "heat/heat_options.h"
#include "io/output_options.h"
#include "meshing/mesh_options.h"
#include "prism/prism_options.h"
#include "projection/project_options.h"
#include "surface/sheet_options.h"

namespace pellicle::world {

/// The clock of a run.
struct TimeOptions {
  Choice<TimeScheme> scheme = TimeScheme::implicit_euler;  ///< sheets: not generalized alpha
  double spectral_radius = 0.8;                            ///< of generalized alpha
  std::optional<double> arc_length;                        ///< of statics: displacement in a second [m/s]
  double step = 2e-3;                                      ///< h [s]
  double end = 1;                                          ///< [s]
  int max_steps = 0;                                       ///< 0: no limit
  int max_retries = 6;                                     ///< how often `step` may be halved after failures
  double tolerance = 0;            ///< of a step's error, a fraction of the sheet's size; 0: steps of equal length
  std::optional<double> max_step;  ///< with a tolerance [s]

  /// The shortest step that follows from failures or from a tolerance [s].
  double shortest_step() const { return std::ldexp(step, -max_retries); }
  /// The longest step with a tolerance [s].
  double longest_step() const { return max_step.value_or(step); }
};

void describe(OptionTable& table, TimeOptions& options);
/// @throws Error where a longest step is shorter than a step
void require_valid(const TimeOptions& options);

/// External force on a sheet or a balloon.
struct ForceOptions {
  Eigen::Vector3d gravity{0, 0, -9.81};  ///< [m/s^2]
  std::optional<double> damping;         ///< of the velocities, see velocity_damping [1/s]
  AirOptions air;
};

void describe(OptionTable& table, ForceOptions& options);

/// When the state of a run is kept.
struct CheckpointOptions {
  int interval_steps = 0;  ///< steps between checkpoints; 0: only the wall clock counts
  /// Wall-clock time between checkpoints [s]; 0: only steps count; none: see wall_interval.
  std::optional<double> interval_wall;
  int keep = 2;  ///< how many are kept, the newest ones; 0: none is written

  /// Wall-clock time after which the next checkpoint is due [s]. Unless it is given: 30 s for the first one, so that a
  /// short run has one; afterwards a twentieth of the run's time, so that at most so much of it is done again, but no
  /// less than 3 min, so that writing them takes next to nothing of it.
  /// @param elapsed wall-clock time since the run began [s] @param is_first whether it has written none
  double wall_interval(double elapsed, bool is_first) const {
    return interval_wall.value_or(is_first ? 30 : std::max(180.0, elapsed / 20));
  }
};

void describe(OptionTable& table, CheckpointOptions& options);

enum class ChainKind { burn, inflate };
inline std::vector<std::string> names_of(ChainKind) { return {"burn", "inflate"}; }

enum class Dynamics { projection, spring, elastic };
inline std::vector<std::string> names_of(Dynamics) { return {"projection", "spring", "elastic"}; }

/// Everything that a deck can say of a run of one object, or of an object and of the run that it is in.
struct Options {
  Choice<ChainKind> chain = ChainKind::burn;
  Choice<Dynamics> dynamics = Dynamics::elastic;
  MeshOptions mesh;
  bool mesh_only = false;  ///< write the mesh and end
  SheetOptions sheet;
  TimeOptions time;
  HeatOptions heat;
  CombustionOptions combustion;
  AblationOptions ablation;
  ForceOptions force;
  ProjectOptions project;
  SpringOptions spring;
  SheetMaterial material;
  ElasticOptions elastic;
  PrismOptions prism;
  WallOptions wall;
  VolumeOptions volume;
  GasOptions gas;
  std::map<std::string, ChamberOptions> chambers;
  ContactOptions contact;
  std::map<std::string, AttachmentOptions> attachments;
  std::map<std::string, PushOptions> forces;
  std::map<std::string, SymmetryOptions> symmetry;
  std::map<std::string, BodyOptions> bodies;
  std::map<std::string, PinOptions> pins;
  OutputOptions output;
  CheckpointOptions checkpoint;
  std::string replay;      ///< file of a saved system to solve in place of a run (linear/saved_system.h), or empty
  std::string restart;     ///< folder of a run, or file of a checkpoint, from which the run goes on; empty: a new run
  int verify_restart = 0;  ///< number of steps run directly and from a checkpoint, and compared; 0: an ordinary run
};

void describe(OptionTable& table, Options& options);

/// @throws Error where options of an object do not go together, as the exclusions of its table say
void require_possible(const Options& options);

/// The name of an object, and its options.
struct NamedOptions {
  explicit NamedOptions(std::string name, Options options = {}) : name(std::move(name)), options(std::move(options)) {}

  std::string name;  ///< empty: the run has one object
  Options options;
};

/// The options of an object of a run, and the table that declares them.
struct ObjectOptions : NamedOptions {
  /// @param name of the object; empty: it is the run's one object, which no deck names
  explicit ObjectOptions(std::string name);

  OptionTable table;
};
/// Whether the steps follow a path of equilibria: statics whose loads have a time of their own.
bool follows_path(const TimeOptions& time);
/// The time integrator of walls, and of sheets that are brought into balance.
TimeIntegrator integrator_of(const TimeOptions& time);
/// How the steps of an elastic sheet are brought into balance, and the contact of a projected one.
ElasticOptions elastic_options(const Options& options);
/// How the mesh of a sheet becomes a shell: the lattice points of a sheet as a material lie in its surface.
SheetOptions shell_options(const Options& options);
/// Rate at which the velocities of a sheet fade [1/s]: `force.damping`, or the default of its dynamics.
double velocity_damping(const Options& options);
/// Whether a run is that of a balloon whose wall heats, burns or tears, which needs something that heats or strains it.
bool balloon_burns(const Options& options);
/// Whether the forces of bodies are brought into balance, with inertia at least (BodyContact): the surface comes to
/// rest at a gap of contact.thickness. Otherwise it is moved out of them (BodyCorrection).
bool balances_bodies(const Options& options);
/// How an object cracks, with the strength of `ablation.strength` or `wall.strength`, if either is given.
/// @throws Error if both are
AblationOptions cracks_of(const Options& options);
/// Whether a link joins a chamber of it to one of another object (share_links).
bool has_links_elsewhere(const Options& options);
/// Whether links, holes or heat of walls change the gas in its chambers, or one is inside another.
bool gas_is_joined(const Options& options);
/// Whether gas acts on walls by more than an even pressure: it has weight, or flows through holes.
bool gas_pushes_unevenly(const Options& options);
/// The gravity that gives gas its weight: 0 without gas.buoyancy [m/s^2].
Eigen::Vector3d gravity_of_gas(const Options& options);

}  // namespace pellicle::world
