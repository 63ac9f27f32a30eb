#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "combustion/combustion.h"
#include "gas/gas_exchange.h"
#include "parallel/records.h"
#include "state/field_registry.h"
#include "surface/surface.h"
#include "world/burning_fields.h"
#include "world/options.h"

namespace pellicle {
inline namespace world {

/// The causes of work on an object, besides contact (ContactWork): entries of State::work. The work of a step is that
/// of the forces with which the step is in balance over its displacements. With steps of implicit Euler kinetic and
/// elastic energy change by the sum of all works less what the steps damp, which falls with their length.
enum class Work {
  gravity,
  damping,   ///< `force.damping` and viscosity; of a balloon C (PrismOptions)
  pins,      ///< that move
  pressure,  ///< across walls, with weights and jets of gas
  bodies,
  air,
  loads  ///< attachments and forces
};
constexpr int kinds_of_work = 7;

/// An entry of a vector of works [J].
inline double& of(Eigen::VectorXd& works, Work kind) { return works[static_cast<Eigen::Index>(kind)]; }

/// The state of an object: the fields of its stages, in one registry. Ghosts are up to date
/// between steps. After a failed step the state is restored by assigning a copy of the registry.
struct State : FieldRegistry {
  /// At rest in the undeformed shape, with the fields that every object has; nothing is pinned and there is no gas. The
  /// surface must outlive the state. Collective.
  explicit State(const Surface& surface);
  /// The same with the fields that the stages of an object of these options add. @param chambers their number
  State(const Surface& surface, const Options& options, int chambers);
  using FieldRegistry::operator=;

  // Declarations of the fields that stages add. They allocate; those that add a Field are collective.

  /// The fields of a surface that heats, burns and is cut; a membrane must be burnable (set_burnable).
  void add_burning(const Surface& surface) { burning.emplace(*this, surface); }
  /// Target lengths of the springs of a sheet, at first the undeformed ones, and its largest strain.
  void add_springs(const Surface& sheet);
  /// Thickness ratios of a wall, at first 1, and how its steps have ended.
  void add_wall();
  /// Pressures of the chambers. @param count of chambers
  void add_chambers(int count);
  /// Mass and heat that the gas in chambers has exchanged, if links, holes or heat change it.
  void add_gas(int chambers, int links);
  /// Particles on which attachments and forces act. @param count of these loads
  void add_loads(int count) { loads = &add<std::vector<bool>>({"loads", "", Item::particle}, count); }
  /// Accelerations, with which generalized alpha goes on.
  void add_acceleration() { acceleration = &add<Field>({"acceleration", "m/s^2", Item::particle}, 3); }
  /// Time of the loads and direction of the path, with which steps by arc length go on.
  void add_path();

  double& time = add<double>({"time", "s", Item::object});
  PetscInt& step = add<PetscInt>({"step", "", Item::object});             ///< accepted steps
  double& next_length = add<double>({"next_length", "s", Item::object});  ///< of the next step, 0: not known yet
  Field& position = add<Field>({"position", "m", Item::particle}, 3);
  Field& velocity = add<Field>({"velocity", "m/s", Item::particle, Drawn::yes}, 3);
  double& contact_work = add<double>({"contact_work", "J", Item::object});  ///< of pressing since time 0 (ContactWork)
  double& friction_work = add<double>({"friction_work", "J", Item::object});  ///< of friction since time 0
  /// Works on the object since time 0, entries by Work [J].
  Eigen::VectorXd& work = add<Eigen::VectorXd>({"work", "J", Item::object}, kinds_of_work);
  /// Number of the pin that holds each local particle, -1: none (Pins).
  std::vector<PetscInt>& pin = add<std::vector<PetscInt>>({"pin", "", Item::particle});
  /// Number of the chamber that each local element bounds, -1: none (Chambers).
  std::vector<PetscInt>& chamber = add<std::vector<PetscInt>>({"chamber", "", Item::cell});
  /// Pressure across the wall of each chamber [Pa], the same on every rank: of a sheet that of the last balance, of a
  /// wall that at the end of the step.
  Eigen::VectorXd& pressure = own<Eigen::VectorXd>();

  std::optional<BurningFields> burning;  ///< none: nothing heats, burns or cracks
  TargetLengths& target_length;          ///< of the local springs of a sheet by colour [m]; empty: a wall
  std::vector<double>& thickness_ratio;  ///< h/h0 of the local elements of a wall; empty: a sheet
  Eigen::VectorXd& record;               ///< numbers for remarks: StrainRecord of a sheet, StepRecord of a wall
  GasExchange* gas = nullptr;            ///< null: nothing changes the gas in chambers, see add_gas
  std::vector<bool>* loads = nullptr;    ///< whether each load acts on each local vertex (PointLoads::chosen)
  Field* acceleration = nullptr;         ///< of generalized alpha, which is not exactly that of this moment [m/s^2]
  double* load_time = nullptr;           ///< by arc length: time of the loads [s]
  Field* direction = nullptr;            ///< by arc length: of the last step, see StepPotential::write_direction

  /// Time at which pressures, places of pins and other loads are taken [s].
  double time_of_loads() const { return load_time != nullptr ? *load_time : time; }
  /// Flags of the surface triangles that have not burnt away; null: nothing burns.
  const std::vector<bool>* active_triangles() const { return burning ? &burning->active.triangles : nullptr; }
  /// Whether nothing is left of the object.
  bool is_gone() const { return burning && burning->pieces.present.empty(); }
};

/// The kinetic energy of an object [J]. Collective. @param mass of the owned particles [kg]
double kinetic_energy(const Surface& surface, const double* mass, const Field& velocity);

/// The records of the owned items of a state, on the way to the same object on a new surface.
Records packed(const FieldRegistry& state, Item item, PetscInt owned);

}  // namespace world
}  // namespace pellicle
