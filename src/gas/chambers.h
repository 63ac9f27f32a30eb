#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "gas/gas_options.h"
#include "mesh/field.h"
#include "mesh/membrane.h"

namespace pellicle {

/// The gas of a chamber at a moment.
struct GasState {
  double volume = 0;             ///< V [m^3]
  double pressure = 0;           ///< across the wall, inside minus outside [Pa]
  double pressure_slope = 0;     ///< dp/dV at constant amount [Pa/m^3]; 0 where the pressure is prescribed
  double absolute_pressure = 0;  ///< [Pa]
  double amount = 0;             ///< n [mol]
  double temperature = 0;        ///< T [K]
  double potential = 0;          ///< W with dW/dV = -p: what the gas and the surroundings can still do [J]
};

/// The chambers of a balloon: volumes enclosed by closed pieces of the membrane (balloon paper, section 5), or by a
/// piece and the symmetry planes that its boundary lies on.
class Chambers {
 public:
  /// Collective. The membrane must outlive the chambers.
  /// @param origin a point of all symmetry planes, about which volumes are taken (any point for closed pieces) [m]
  /// @throws Error that names the chamber: an open piece whose law needs a volume, options that exclude each other ...
  Chambers(const Membrane& membrane, const std::map<std::string, ChamberOptions>& options,
           const Eigen::Vector3d& origin, bool has_symmetry_planes);

  int count() const;
  const std::string& name(int chamber) const;
  /// Chamber of a local element, -1 if it bounds none.
  int of_element(PetscInt element) const;

  /// V0, from the undeformed positions, the same on every rank [m^3].
  double initial_volume(int chamber) const;
  /// V of all chambers (eq. 13), summed over the ranks [m^3]. Collective.
  Eigen::VectorXd volumes(const Field& positions) const;
  /// dV/dx = A n / 3 (eq. 15 without p) of the owned vertices for one chamber, zero elsewhere, (3 x owned) [m^2].
  Eigen::Matrix3Xd volume_gradient(int chamber, const Field& positions) const;

  /// The gas by its law at a volume [m^3] and time [s].
  GasState state(int chamber, double volume, double time) const;
  /// Whether the volume is given and the pressure is what keeps it.
  bool prescribes_volume(int chamber) const;
  double prescribed_volume(int chamber, double time) const;

 private:
  /// Implementation: the gas engineer's.
};

/// The geometric load stiffness of an element under pressure p: d f/dx of f_i = p/3 An with one symmetric element matrix
/// each, such that the sum over a closed surface is exact, (9 x 9) [N/m].
/// @param x1, x2, x3 positions relative to the chamber's origin [m]
Eigen::Matrix<double, 9, 9> load_stiffness(double pressure, const Eigen::Vector3d& x1, const Eigen::Vector3d& x2,
                                           const Eigen::Vector3d& x3);

}  // namespace pellicle
