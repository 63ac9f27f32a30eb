#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "combustion/combustion.h"
#include "gas/gas_exchange.h"
#include "state/field_registry.h"
#include "surface/active_set.h"
#include "surface/pieces.h"
#include "surface/surface.h"
#include "world/options.h"

namespace pellicle::world {

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

/// How the steps of a wall have ended so far: entries of State::record.
enum class StepRecord {
  above_tolerance,     ///< steps that ended out of balance
  worst_step,          ///< number of the worst of these
  worst_residual,      ///< its relative residual
  last_residual,       ///< relative residual of the last step
  concave_steps,       ///< steps in which a tangent was not positive definite
  first_concave_step,  ///< number of the first of these
  factorised_steps,    ///< steps in which the tangent was factorised
};
constexpr int kinds_of_step_record = 7;

/// The course of a fire so far: entries of BurningFields::fire_record.
enum class FireRecord {
  burnt,         ///< fraction of the initial mass
  last_time,     ///< time of the last step in which mass was lost [s]; -1: there has been none
  present_time,  ///< time of the last step [s]
  hottest        ///< the highest temperature so far [K]
};
constexpr int kinds_of_fire_record = 4;

/// An entry of a vector of works [J] or of a record.
template <class Numbers, class Kind>
auto& of(Numbers& numbers, Kind kind) {
  return numbers[static_cast<Eigen::Index>(kind)];
}

/// The fields of a surface that heats, burns and is cut.
struct BurningFields {
  /// Everything lives and has its initial mass; temperatures and pieces are not set yet. The registry must outlive
  /// it. Collective.
  BurningFields(FieldRegistry& registry, const Surface& surface);

  FieldRegistry& registry;  ///< of the state, in which they are declared
  Field& temperature = registry.add<Field>({"temperature", "K", Item::particle, Drawn::of_both_layers});
  /// 0: the particle has been removed from the surface.
  Field& mass = registry.add<Field>({"mass", "kg", Item::particle, Drawn::no, false, true});
  /// Of the last step, at most 0.
  Field& mass_change = registry.add<Field>({"mass_change", "kg", Item::particle, Drawn::no, false, true});
  Pieces& pieces = registry.own<Pieces>();
  /// When each local element began to burn away; -1: not yet.
  std::vector<double>& burn_time = registry.add<std::vector<double>>({"burn_time", "s", Item::cell, Drawn::yes});
  ActiveSet& active;
  /// Since the beginning, by the owned particles, with what was left when they left.
  double& mass_burnt = registry.add<double>({"mass_burnt", "kg", Item::sum});
  // Since the beginning, each side counted by the rank that had it.
  double& cracked_sides = registry.add<double>({"cracked_sides", "", Item::sum});
  double& crack_length = registry.add<double>({"crack_length", "m", Item::sum});  ///< undeformed
  // Heat ledger, of the owned particles: the content is initial + in - out + made.
  double& heat_initial = registry.add<double>({"heat_initial", "J", Item::sum});  ///< by those owned at the beginning
  double& heat_in = registry.add<double>({"heat_in", "J", Item::sum});  ///< from sources, burning, warmer surroundings
  double& heat_out = registry.add<double>({"heat_out", "J", Item::sum});    ///< to cooler ones and with what burnt
  double& heat_made = registry.add<double>({"heat_made", "J", Item::sum});  ///< by conduction that does not conserve it
  /// Numbers for remarks at the end of a run, by FireRecord.
  Eigen::VectorXd& fire_record = registry.add<Eigen::VectorXd>({"fire_record", "", Item::object}, kinds_of_fire_record);
};

/// The state of an object: the fields of its stages, in one registry. Ghosts are up to date between steps. After a
/// failed step the state is restored by assigning a copy of the registry.
struct State : FieldRegistry {
  /// At rest in the undeformed shape, with the fields that every object has and those of the stages that the options
  /// ask for. Target lengths of springs are the undeformed ones, thickness ratios 1; nothing is pinned or chosen, and
  /// nothing is in the chambers. The surface must outlive the state; a membrane that burns must be burnable
  /// (set_burnable). Collective. @param chambers their number
  State(const Surface& surface, const Options& options, int chambers);
  using FieldRegistry::operator=;
  State& operator=(const State& other) {
    FieldRegistry::operator=(other);
    return *this;
  }

  double& time = add<double>({"time", "s", Item::object});
  PetscInt& step = add<PetscInt>({"step", "", Item::object});             ///< accepted steps
  double& next_length = add<double>({"next_length", "s", Item::object});  ///< of the next step, 0: not known yet
  Field& position = add<Field>({"position", "m", Item::particle}, 3);
  Field& velocity = add<Field>({"velocity", "m/s", Item::particle, Drawn::yes}, 3);
  FactorisedSteps& factorised_steps = own<FactorisedSteps>();               ///< of the balance of this object
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
  /// Numbers for remarks at the end of a run: of a wall by StepRecord; of a sheet the largest strain of its weave in
  /// any step so far, -1 before the first, its place [m] and its time [s].
  Eigen::VectorXd& record;
  GasExchange* gas = nullptr;          ///< null: no links, holes or heat change the gas in chambers
  std::vector<bool>* loads = nullptr;  ///< whether each load acts on each local vertex (PointLoads::chosen)
  Field* acceleration = nullptr;       ///< of generalized alpha, which is not exactly that of this moment [m/s^2]
  double* load_time = nullptr;         ///< by arc length: time of the loads [s]
  Field* direction = nullptr;          ///< by arc length: of the last step, see PathPart::write_direction

  /// Time at which pressures, places of pins and other loads are taken [s].
  double time_of_loads() const { return load_time != nullptr ? *load_time : time; }
  /// Flags of the surface triangles that have not burnt away; null: nothing burns.
  const std::vector<bool>* active_triangles() const { return burning ? &burning->active.triangles : nullptr; }
};

/// The kinetic energy of an object [J]. Collective. @param mass of the owned particles [kg]
double kinetic_energy(const Surface& surface, const double* mass, const Field& velocity);

/// Tells in words of something that would move, or turn, so far in the next step that neither contact nor a balance of
/// forces could follow: a vertex by its velocity, gravity or the wind, or pins and bodies that a deck leads along a
/// path. Empty: nothing does. Collective.
/// @param state at the start of the step @param h its length [s]
std::string beyond_reach(const Options& options, const Surface& surface, const State& state, double h);

/// Looks in a state for the results of overflow, or of a solver that diverged. Collective.
/// @returns "the velocity is not finite" for the first field of which some rank holds such a number; "" if there is
/// none
std::string non_finite(MPI_Comm comm, const FieldRegistry& state);

/// Sets values of a state that are not finite to 0, so that it can be drawn. Collective. @returns whether there were
/// any
bool make_finite(MPI_Comm comm, const FieldRegistry& state);

}  // namespace pellicle::world
