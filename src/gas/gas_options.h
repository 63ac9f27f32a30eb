#pragma once

#include <optional>
#include <string>

#include "base/options.h"

namespace pellicle {
inline namespace gas {

/// Derivative of the pressure force (GasOptions::tangent).
enum class GasTangent { paper, rank1, exact };
inline const std::vector<std::string>& names_of(GasTangent) {
  static const std::vector<std::string> names{"paper", "rank1", "exact"};
  return names;
}

enum class GasLaw { relative, isothermal, adiabatic, pressure, volume };
inline const std::vector<std::string>& names_of(GasLaw) {
  static const std::vector<std::string> names{"relative", "isothermal", "adiabatic", "pressure", "volume"};
  return names;
}

/// The gas of all chambers.
struct GasOptions {
  Choice<GasTangent> tangent = GasTangent::exact;
  double ambient_pressure = 101325;  ///< outside, absolute [Pa]
};

void describe(OptionTable& table, GasOptions& options);

/// A volume filled with gas, as a deck gives it: one of the named objects `chambers`. Quantities in time are key points
/// (time [s], value), linear between, constant outside; empty: not given.
struct ChamberOptions {
  /// relative: the paper's p = p0 V0/V with nothing outside (eq. 14); isothermal: p V = n R T against ambient pressure;
  /// adiabatic: p V^gamma constant but for n; pressure, volume: prescribed.
  Choice<GasLaw> law = GasLaw::relative;
  int vertex = -1;              ///< persistent id of a vertex of its piece; -1: every piece that no chamber names
  Rows pressure;                ///< relative: p0, absolute with nothing outside; pressure: gauge, across the wall [Pa]
  Rows amount;                  ///< n [mol]
  Rows amount_ratio;            ///< n over what fills V0 at ambient pressure and the temperature at time 0
  Rows temperature;             ///< T(t); adiabatic: one row, T0 [K]
  std::optional<double> gamma;  ///< adiabatic exponent, 1.4 unless given
  Rows volume_ratio;            ///< V/V0
  Rows volume;                  ///< V [m^3]
};

void describe(OptionTable& table, ChamberOptions& options);

}  // namespace gas
}  // namespace pellicle
