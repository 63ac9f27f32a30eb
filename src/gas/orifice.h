#pragma once

namespace pellicle {
inline namespace gas {

/// Flow through an orifice and its derivatives.
struct OrificeFlow {
  double flow = 0;            ///< [mol/s]
  double by_upstream = 0;     ///< by the pressure upstream [mol/(s Pa)]
  double by_downstream = 0;   ///< by the pressure downstream, 0 where the flow is choked [mol/(s Pa)]
  double by_temperature = 0;  ///< by the temperature upstream [mol/(s K)]
};

/// An ideal gas that flows through an orifice without friction or heat, up to the speed of sound (Saint-Venant and
/// Wantzel 1839): with r the ratio of the pressures and g = gamma,
///
///     flow = A p / sqrt(M R T) sqrt(2 g/(g - 1) (r^(2/g) - r^((g + 1)/g))),
///
/// where r is not less than (2/(g + 1))^(g/(g - 1)), at which the flow is choked. Within a millionth of r = 1 it is in
/// proportion to the difference of the pressures, so that its derivatives are finite everywhere.
/// @param area of the orifice times the discharge coefficient [m^2]
/// @param upstream absolute pressure [Pa] @param downstream absolute pressure, at most `upstream` [Pa]
/// @param temperature upstream [K] @param gamma ratio of the heat capacities @param molar_mass M [kg/mol]
OrificeFlow orifice_flow(double area, double upstream, double downstream, double temperature, double gamma,
                         double molar_mass);

/// Force of the jet on the surface that it leaves, over the area times the discharge coefficient: the momentum of the
/// flow and, where it is choked, the excess of its pressure over that outside [Pa]. 0 if nothing flows out. Arguments
/// as for orifice_flow.
double jet_thrust(double upstream, double downstream, double gamma);

}  // namespace gas
}  // namespace pellicle
