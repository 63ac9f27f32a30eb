#pragma once

#include <petscsys.h>

#include <Eigen/Core>
#include <vector>

#include "gas/gas_network.h"

namespace pellicle {
inline namespace gas {

/// The gas and heat that links and walls have brought into the chambers of an object since time 0, and the gas on both
/// sides of each wall. An object has one GasExchange, in its registered state; chambers and networks take it as an
/// argument and keep no copy.
struct GasExchange {
  /// Nothing has been exchanged; no chamber lies inside another.
  GasExchange(int chambers, int links);

  Eigen::VectorXd amount;         ///< into each chamber [mol]
  Eigen::VectorXd heat;           ///< into each chamber, see VesselGas [mol K]
  std::vector<PetscInt> open;     ///< 1: the chamber is permanently open, its pressure is that outside; 0: it is not
  Eigen::VectorXd leak_amount;    ///< out through each wall, or in through walls that it lies round [mol]
  Eigen::VectorXd leak_enthalpy;  ///< that it carried, and what moving caps of holes pushed away beyond them [J]
  Eigen::VectorXd wall_heat;      ///< that walls have given to each gas [J]
  Eigen::VectorXd work;           ///< on walls, of the gas of each chamber that links or heat join to anything [J]
  Eigen::VectorXd link_amount;    ///< through each link, in the order of their names [mol]
  Eigen::VectorXd link_enthalpy;  ///< enthalpy that the links carried [J]
  Eigen::VectorXd first_energy;   ///< of the gas in each chamber at time 0 [J]
  /// V of each chamber at the end of the last step, up to which work is counted; of an open chamber V where it opened,
  /// which stands for what is left of the chamber [m^3].
  Eigen::VectorXd volume;

  // The gas on both sides of the wall of each chamber.
  std::vector<PetscInt> inside;   ///< number of the chamber: its own, or that of which it has become a part
  std::vector<PetscInt> outside;  ///< number of the chamber round it; -1: the ambient air

  // Of chambers that have been cut in two.
  std::vector<PetscInt> parent;      ///< number of the chamber that each was a part of; -1: it was there at first
  Eigen::VectorXd reference_volume;  ///< V0 of each; of a part that of its parent [m^3]

  int chambers() const { return static_cast<int>(inside.size()); }
  /// Number of the chamber whose gas is inside a wall: its own, or that of which the chamber has become a part.
  int gas_inside(int wall) const { return static_cast<int>(inside[wall]); }
  /// Number of the chamber whose gas is round a wall; GasNetwork::ambient: the ambient air.
  int gas_outside(int wall) const {
    return outside[wall] < 0 ? GasNetwork::ambient : static_cast<int>(inside[outside[wall]]);
  }
  /// Whether a chamber has become a part of another, which has its gas.
  bool is_part(int chamber) const { return inside[chamber] != chamber; }
  bool is_open(int chamber) const { return open[chamber] != 0; }
  /// V of the gas of all chambers: W less what the walls inside them enclose; 0 of parts of others.
  /// @param walls W [m^3]
  Eigen::VectorXd gas_volumes(const Eigen::VectorXd& walls) const;
  /// Chambers that have gas of their own, each before the one round it.
  std::vector<int> from_within() const;
  /// W of all chambers at the end of the last step; of an open one where it opened [m^3].
  Eigen::VectorXd last_volumes() const;
  /// Adds a chamber without gas: a part of another.
  void add_part(int chamber);
};

/// Properties of the walls of the chambers for their gas in a step.
struct ChamberWalls {
  Eigen::VectorXd area;                 ///< [m^2]
  Eigen::VectorXd hole_area;            ///< of the caps [m^2]
  std::vector<GasNetwork::Leak> leaks;  ///< through which gas gets out and in; its ends are chambers
  Eigen::VectorXd conductance;          ///< for heat into each chamber, of its wall and those within it [W/K]
  Eigen::VectorXd temperature;          ///< [K]
};

/// The data of the gas of an object in a step. The object owns it; the gas of the step refers to it.
struct GasStep {
  /// By the beginning of the step: in the registered state of the object, or Chambers::initial_exchange.
  const GasExchange* exchange = nullptr;
  ChamberWalls walls{};  ///< at the beginning of the step; empty between steps
  double h = 0;          ///< length [s]; 0 between steps
};

}  // namespace gas
}  // namespace pellicle
