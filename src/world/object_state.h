#pragma once

#include "gas/chambers.h"
#include "state/field_registry.h"
#include "world/work.h"

namespace pellicle {
inline namespace world {

/// What changes in every object from step to step. Ghosts are up to date between steps. After a failed step the state
/// is restored by assigning a copy.
struct ObjectState : FieldRegistry {
  using FieldRegistry::FieldRegistry;
  ObjectState(ObjectState&&) = default;
  ObjectState& operator=(const ObjectState& other) {
    FieldRegistry::operator=(other);
    return *this;
  }

  /// To be called if links or heat change the gas in its chambers. Not collective. @param chambers number of its
  /// chambers @param links number of its links
  void add_gas(int chambers, int links) {
    gas = &own<GasExchange>(chambers, links);
    declare({"gas_amount", "mol", Item::object}, gas->amount, chambers);
    declare({"gas_heat", "mol K", Item::object}, gas->heat, chambers);
    declare({"gas_open", "", Item::object}, gas->open, chambers);
    declare({"leak_amount", "mol", Item::object}, gas->leak_amount, chambers);
    declare({"leak_enthalpy", "J", Item::object}, gas->leak_enthalpy, chambers);
    declare({"gas_wall_heat", "J", Item::object}, gas->wall_heat, chambers);
    declare({"gas_work", "J", Item::object}, gas->work, chambers);
    declare({"link_amount", "mol", Item::object}, gas->link_amount, links);
    declare({"link_enthalpy", "J", Item::object}, gas->link_enthalpy, links);
    declare({"gas_first_energy", "J", Item::object}, gas->first_energy, chambers);
    declare({"gas_last_volume", "m^3", Item::object}, gas->volume, chambers);
    declare({"gas_inside", "", Item::object}, gas->inside, chambers);
    declare({"gas_outside", "", Item::object}, gas->outside, chambers);
    declare({"gas_parent", "", Item::object}, gas->parent, chambers);
    declare({"gas_reference_volume", "m^3", Item::object}, gas->reference_volume, chambers);
  }

  double& time = add<double>({"time", "s", Item::object});
  PetscInt& step = add<PetscInt>({"step", "", Item::object});             ///< accepted steps
  double& next_length = add<double>({"next_length", "s", Item::object});  ///< of the next step, see Chain::length
  Field& position = add<Field>({"position", "m", Item::particle}, 3);
  Field& velocity = add<Field>({"velocity", "m/s", Item::particle, Drawn::yes}, 3);
  double& contact_work = add<double>({"contact_work", "J", Item::object});    ///< see ContactWork, up to now
  double& friction_work = add<double>({"friction_work", "J", Item::object});  ///< likewise
  /// Done on it since time 0, see Work.
  Eigen::VectorXd& work = add<Eigen::VectorXd>({"work", "J", Item::object}, kinds_of_work);
  GasExchange* gas = nullptr;  ///< see add_gas
};

}  // namespace world
}  // namespace pellicle
