#pragma once

#include <string>

#include "gas/gas_options.h"

namespace pellicle {
inline namespace gas {

constexpr double default_temperature = 293.15;  ///< of a chamber's gas [K]
constexpr double default_gamma = 1.4;           ///< ratio of the heat capacities of an adiabatic gas

/// Checks the keys of a chamber against its law. @param chamber its key in the deck
/// @param ambient_pressure [Pa], by which a gauge pressure may be below 0
/// @throws Error on keys that the law lacks or does not use, and on values out of range
void require_valid_chamber(const std::string& chamber, const ChamberOptions& options, double ambient_pressure);

}  // namespace gas
}  // namespace pellicle
