#pragma once

#include <string>
#include <vector>

#include "gas/flowing_gas.h"
#include "parallel/field.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace world {

/// What the gas in a sheet does in a step: h W g p is added to its velocities before what holds the sheet together
/// acts, with the volume's gradient g, the inverse masses W of what is not held, and the pressure p.
///
/// The pressure is that of the law at the volume at the end of the step. How far p moves that volume is known for a
/// sheet without springs (h^2 g.W g); for the sheet as it is it follows from solving the step with two pressures, and a
/// secant through them gives the next (`is_done`). So stiff gas in a small chamber asks for no shorter steps, and taut
/// material bears the pressure that is in the history. Of a sheet of one layer the corners feel what acts on the
/// centres of their cells.
class GasPush {
 public:
  /// Gas, of one object, and sheet must outlive it. Collective.
  /// @param free positions to which velocities alone lead, ghosts up to date [m]
  /// @param mass of the local particles, of those that move [kg] @param held local particles that nothing moves
  /// @param time at the end of the step [s] @param h its length [s]
  GasPush(const FlowingGas& gas, const Sheet& sheet, const Field& free, const std::vector<double>& mass,
          const std::vector<bool>& held, double time, double h);

  /// What to add to the velocities of the local particles, (3 x local) [m/s].
  const Field& velocity() const { return velocity_; }
  /// Of each chamber [Pa].
  const std::vector<double>& pressure() const { return pressure_; }

  /// Whether the step that has led to these positions is the last try: it agrees with the laws, or enough others have
  /// not. If not, other pressures are ready. Collective.
  bool is_done(const Field& end);
  /// In words, how the last try does not agree with a law; empty: it does.
  const std::string& disagreement() const { return disagreement_; }

 private:
  void choose_pressures();

  const FlowingGas& gas_;
  const Chambers& chambers_;
  double time_;  ///< at the end of the step [s]
  int solves_ = 0;
  std::string disagreement_;
  std::vector<Field> moves_;           ///< h W g of each chamber, (3 x local) [m/(s Pa)]
  Eigen::VectorXd intercept_;          ///< W at the end of the step without pressure, as far as known [m^3]
  Eigen::VectorXd compliance_;         ///< by how much a pressure moves it, likewise [m^3/Pa]
  Eigen::VectorXd free_compliance_;    ///< without springs
  std::vector<double> pressure_;       ///< [Pa]
  Eigen::VectorXd expected_;           ///< W at which the laws give them [m^3]
  std::vector<double> last_pressure_;  ///< of the solve before
  Eigen::VectorXd last_volume_;        ///< W to which it has led
  Field velocity_;
};

}  // namespace world
}  // namespace pellicle
