#pragma once

#include <map>
#include <optional>
#include <string>

#include "options/options.h"

namespace pellicle::gas {

inline constexpr double gas_constant = 8.31446261815324;  ///< R [J/(mol K)], exact

/// Derivative of the pressure force (GasOptions::tangent).
enum class GasTangent { paper, rank1, exact };
inline std::vector<std::string> names_of(GasTangent) { return {"paper", "rank1", "exact"}; }

enum class GasLaw { relative, isothermal, adiabatic, pressure, volume };
inline std::vector<std::string> names_of(GasLaw) {
  return {"relative", "isothermal", "adiabatic", "pressure", "volume"};
}

/// A link between two chambers, or a chamber and the ambient air: a hole, a tube, a valve or a pump.
struct LinkOptions {
  std::string from;                   ///< name of a chamber; empty: the ambient air
  std::string to;                     ///< name of a chamber; empty: the ambient air
  std::optional<double> area;         ///< of the narrowest place [m^2]
  double discharge = 1;               ///< coefficient of the flow, of a sharp edge 0.6
  Rows opens;                         ///< key points (time [s], fraction of the area that is open); empty: all of it
  bool one_way = false;               ///< nothing flows back from `to`
  Rows flow;                          ///< of a pump, in place of an area: key points (time [s], flow [mol/s])
  std::optional<double> temperature;  ///< of gas that a pump brings from outside; none: of the ambient air [K]
};

void describe(OptionTable& table, LinkOptions& options);

/// The gas of all chambers and their links.
struct GasOptions {
  Choice<GasTangent> tangent = GasTangent::exact;
  double ambient_pressure = 101325;     ///< outside, absolute [Pa]
  double ambient_temperature = 293.15;  ///< of the air that flows in from outside [K]
  bool buoyancy = false;                ///< gas lighter than the air lifts
  double molar_mass = 0.0289647;        ///< M of the gas [kg/mol]
  std::map<std::string, LinkOptions> links;
};

void describe(OptionTable& table, GasOptions& options);

/// A volume filled with gas, as a deck gives it: one of the named objects `chambers`. Quantities in time are key points
/// (time [s], value), linear between, constant outside; empty: not given.
struct ChamberOptions {
  /// relative: the paper's p = p0 V0/V with nothing outside (eq. 14); isothermal: p V = n R T against ambient pressure;
  /// adiabatic: p V^gamma constant but for n; pressure, volume: prescribed.
  Choice<GasLaw> law = GasLaw::relative;
  int vertex = -1;              ///< persistent id of a vertex of the piece; -1: every piece that no chamber names
  Rows pressure;                ///< relative: p0, absolute with nothing outside; pressure: gauge, across the wall [Pa]
  Rows amount;                  ///< n [mol]
  Rows amount_ratio;            ///< n over the amount in V0 at ambient pressure and the temperature at time 0
  Rows temperature;             ///< T(t); adiabatic: one row, T0 [K]
  std::string inside;           ///< name of the chamber round this one; empty: the ambient air
  std::optional<double> gamma;  ///< adiabatic exponent, 1.4 unless given
  std::optional<double> hole_discharge;  ///< coefficient of flow through holes; none: the wall must be closed
  double permeability = 0;               ///< fraction of the wall's area through which gas seeps as through holes
  double heat_transfer = 0;              ///< adiabatic: coefficient between wall and gas [W/(m^2 K)]
  double wall_temperature = 293.15;      ///< of a wall that has no temperature of its own [K]
  Rows volume_ratio;                     ///< V/V0
  Rows volume;                           ///< V [m^3]
};

void describe(OptionTable& table, ChamberOptions& options);

}  // namespace pellicle::gas
