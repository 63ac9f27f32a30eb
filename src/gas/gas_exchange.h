#pragma once

#include <petscsys.h>

#include <Eigen/Core>
#include <array>
#include <vector>

#include "gas/gas_network.h"

namespace pellicle::gas {

/// The gas and heat that links and walls have brought into the chambers of an object since time 0, and the gas on both
/// sides of each wall. An object has one GasExchange, in its registered state; chambers and networks take it as an
/// argument and keep no copy.
struct GasExchange {
  /// Nothing has been exchanged; no chamber lies inside another.
  GasExchange(int chambers, int links);

  Eigen::VectorXd amount;         ///< into each chamber [mol]
  Eigen::VectorXd heat;           ///< into each chamber, as VesselGas::heat [mol K]
  std::vector<PetscInt> open;     ///< 1: permanently open, at the pressure outside; 0: not
  Eigen::VectorXd leak_amount;    ///< out of each chamber through its wall and those within it [mol]
  Eigen::VectorXd leak_enthalpy;  ///< carried by leaks, and work of moving caps on the gas beyond [J]
  Eigen::VectorXd wall_heat;      ///< from walls into each chamber's gas [J]
  Eigen::VectorXd work;           ///< of each joined chamber's gas on walls [J]
  Eigen::VectorXd link_amount;    ///< through each link, in the order of their names [mol]
  Eigen::VectorXd link_enthalpy;  ///< carried through each link [J]
  Eigen::VectorXd first_energy;   ///< of the gas in each chamber at time 0 [J]
  /// V of each chamber at the end of the last step, up to which work is counted; of an open chamber V when it opened,
  /// which stays its volume [m^3].
  Eigen::VectorXd volume;

  // The chambers on both sides of each chamber's wall.
  std::vector<PetscInt> inside;   ///< number of the chamber: its own, or that of which it has become a part
  std::vector<PetscInt> outside;  ///< number of the chamber round it; -1: the ambient air

  // The origin of chambers that have been cut in two.
  std::vector<PetscInt> parent;      ///< number of the chamber it was cut off; -1: an initial chamber
  Eigen::VectorXd reference_volume;  ///< V0 of each chamber; of a part V0 of its parent [m^3]

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
  /// V of the gas of all chambers: W less W of the walls inside them; 0 of parts of others.
  /// @param walls W [m^3]
  Eigen::VectorXd gas_volumes(const Eigen::VectorXd& walls) const;
  /// Chambers that have gas of their own, each before the one round it.
  std::vector<int> from_within() const;
  /// The inverse of gas_volumes: sums over each chamber and all chambers inside it, such as W as the sums of V.
  /// @param of_gas an amount in the gas of each chamber, such as V [m^3]
  Eigen::VectorXd within_walls(Eigen::VectorXd of_gas) const;
  /// Adds a chamber without gas as a part of a given one.
  void add_part(int chamber);

 private:
  /// The vectors of numbers with one for each chamber.
  std::array<Eigen::VectorXd*, 9> of_chambers() {
    return {&amount, &heat, &leak_amount, &leak_enthalpy, &wall_heat, &work, &first_energy, &volume, &reference_volume};
  }
};

/// Properties of the walls of the chambers for their gas in a step.
struct ChamberWalls {
  Eigen::VectorXd area;                 ///< [m^2]
  Eigen::VectorXd hole_area;            ///< of the caps [m^2]
  std::vector<GasNetwork::Leak> leaks;  ///< ways of gas through walls; their ends are chambers
  Eigen::VectorXd conductance;          ///< for heat into each chamber from its wall and those within it [W/K]
  Eigen::VectorXd temperature;          ///< [K]
};

/// The data of the gas of an object in a step. The object owns it; the gas of the step refers to it.
struct GasStep {
  /// Exchange up to the step's beginning: in the registered state of the object, or Chambers::initial_exchange.
  const GasExchange* exchange = nullptr;
  ChamberWalls walls{};  ///< at the beginning of the step; empty between steps
  double h = 0;          ///< length [s]; 0 between steps
};

}  // namespace pellicle::gas
