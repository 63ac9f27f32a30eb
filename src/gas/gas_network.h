#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "gas/gas_options.h"

namespace pellicle::gas {

/// The gas in a vessel of a network, without its volume.
struct VesselGas {
  double amount = 0;  ///< n [mol]
  /// n times the temperature that the gas would have after adiabatic change to the vessel's reference volume; n T for a
  /// vessel that keeps its temperature [mol K].
  double heat = 0;
};

/// Vessels of ideal gas and the links between them and the ambient air: solves for amounts and energies at the end of a
/// step from the vessels' volumes there. Independent of walls and ranks.
///
/// The step is one of implicit Euler,
///
///     n - n^0 = h sum_l q_l,    U - U^0 + (work from V^0 to V) = h sum_l q_l c_p T_l + h H (T_w - T),
///
/// with the flows q_l, all temperatures and pressures at its end: however wide a link is, the step does not pass the
/// equilibrium. T_l is the temperature upstream; the flow carries enthalpy, c_p T. For a vessel that keeps its
/// temperature the second equation is left out. Mass and energy that leave one vessel arrive in another to the last
/// digit, since both come from the same flow.
///
/// The work is the adiabatic one of the gas at the step's start up to the volume sqrt(V^0 V), and of the gas at its end
/// from there on: of second order in the changes of volume and amount, and without flow exactly isentropic.
class GasNetwork {
 public:
  struct Vessel {
    bool keeps_temperature = true;
    double gamma = 1.4;           ///< ratio of the heat capacities
    double reference_volume = 1;  ///< [m^3]
  };
  struct Link {
    std::string name;
    int from = ambient;  ///< number of a vessel
    int to = ambient;
    LinkOptions options;  ///< without names
  };
  static constexpr int ambient = -1;

  /// A way from a vessel through its wall to the ambient air, or to the vessel round it.
  struct Leak {
    int vessel = 0;
    double area = 0;        ///< times the discharge coefficient [m^2]
    double rise = 0;        ///< pressure difference at the leak less that between the vessels [Pa]
    int outside = ambient;  ///< number of a vessel
  };

  /// The data of a step before it is solved.
  struct Step {
    std::vector<VesselGas> gas;    ///< at the start, but with prescribed amounts of the step's end
    Eigen::VectorXd volume;        ///< at the end [m^3]
    Eigen::VectorXd start_volume;  ///< V^0 [m^3]
    Eigen::VectorXd temperature;   ///< at the end, of vessels that keep it [K]
    std::vector<Leak> leaks;
    Eigen::VectorXd conductance;       ///< H of the walls [W/K]; empty: 0
    Eigen::VectorXd wall_temperature;  ///< T_w [K]; empty where there is no conductance
    double time = 0;                   ///< at the end [s]
    double h = 0;                      ///< length [s]
  };
  /// The solution of a step.
  struct End {
    bool converged = true;  ///< whether amounts and energies are in balance to rounding
    std::vector<VesselGas> gas;
    Eigen::VectorXd pressure;       ///< absolute [Pa]
    Eigen::VectorXd temperature;    ///< [K]
    Eigen::VectorXd flow;           ///< through each link, from `from` to `to` [mol]
    Eigen::VectorXd enthalpy;       ///< carried through each link [J]
    Eigen::VectorXd leak;           ///< net, out of each vessel through leaks [mol]
    Eigen::VectorXd leak_enthalpy;  ///< [J]
    Eigen::VectorXd wall_heat;      ///< from each wall into the gas [J]
  };

  GasNetwork() = default;
  /// @throws Error that names the link and the key: no chamber at either end, the same at both, neither or both of area
  /// and flow, invalid key points, an open share outside 0 to 1, a negative flow, chambers of different gamma
  GasNetwork(std::vector<Vessel> vessels, std::vector<Link> links, const GasOptions& gas);

  int count() const { return static_cast<int>(vessels_.size()); }
  const Vessel& vessel(int number) const { return vessels_[number]; }

  End solve(const Step& step) const;
  /// The derivatives of the pressures by the volumes where a step ends, dp_i/dV_j in row i [Pa/m^3].
  Eigen::MatrixXd slopes(const Step& step, const End& end) const;

 private:
  class Balance;

  std::vector<Vessel> vessels_;
  std::vector<Link> links_;
  GasOptions gas_;
};

}  // namespace pellicle::gas
