#pragma once

#include <string>
#include <vector>

#include "gas/chambers.h"
#include "io/history.h"
#include "surface/split_corners.h"
#include "world/burning_fields.h"
#include "world/object_state.h"

namespace pellicle {
inline namespace world {

// The part of the history and of the run's last lines about the gas in an object, be it a sheet or a balloon.

/// What its chambers have exchanged: that of its state, or nothing where no chamber is joined to anything.
inline const GasExchange& exchange_of(const Chambers& chambers, const ObjectState& state) {
  return state.gas != nullptr ? *state.gas : chambers.initial_exchange();
}

/// The columns of its history.
std::vector<History::Column> gas_columns(const Chambers& chambers);

/// Their values. Collective.
/// @param pressure of each chamber, of which those of prescribed volume are looked at [Pa]
/// @param time of the amounts, temperatures and pressures that are given [s]
std::vector<double> gas_values(const Chambers& chambers, const ObjectState& state, const double* pressure, double time);

/// Whether each chamber has opened permanently or become a part of another; empty if gas does not flow.
std::vector<bool> opened_chambers(const ObjectState& state);

/// The lines that report chambers which have opened permanently or become parts of others, one for each.
/// @param reported of each chamber, by earlier calls; a run that goes on from a checkpoint begins with opened_chambers
std::vector<std::string> newly_open(const Chambers& chambers, const ObjectState& state, std::vector<bool>& reported);

/// Divides the chambers whose walls have come apart (Chambers::divided), in the state. Collective.
/// @param piece of each local particle @param numbers of the chamber of each local element @returns a line for each
/// chamber that has been cut; if there is any, there are more chambers
std::vector<std::string> divide_chambers(const Chambers& chambers, const std::vector<PetscInt>& piece,
                                         ObjectState& state, std::vector<PetscInt>& numbers);

/// Where a chamber that needs a closed surface has a hole: chamber, element, place, in words and the same on all ranks.
/// Empty: nowhere. Collective.
std::string hole(const Chambers& chambers, const Surface& surface, const Field& position, const BurningFields& fields);

/// The same where cracks part the surface round a chamber that needs it closed: chamber, vertex, place. Collective.
std::string torn_open(const Chambers& chambers, const Surface& surface, const Field& position,
                      const SplitCorners& corners);

}  // namespace world
}  // namespace pellicle
