#pragma once

#include <vector>

#include "equilibrium/step_gas.h"
#include "parallel/field.h"
#include "surface/sheet.h"

namespace pellicle::world {

/// The gas in a projected sheet in a step, its own or one with that in chambers of other objects: h W g p is added to
/// the sheet's velocities before the projection, with the volume's gradient g, the inverse masses W of the particles
/// that are not constrained, and the pressure p.
///
/// The pressure is that of the law at the volume to which it would push the sheet if that had no springs, whose
/// response is known (h^2 g.W g): projected springs have no stiffness that would answer a pressure in proportion.
/// Chambers of other objects that are linked to the gas see the volume as the projection has left it. In a sheet of one
/// layer the forces on the centres of cells act on the corners of the cells.
class PressureImpulse : public GasFilled {
 public:
  /// All must outlive it. @param start positions at the beginning of a step
  PressureImpulse(const Sheet& sheet, const Chambers& chambers, const GasStep& gas_step, const Field& start);

  StepGas::Part gas_part() const override {
    return {{"", &chambers_, &gas_step_}, &start_, &end_, GasTangent::exact, 0, {}, true};
  }
  /// Begins the step of the gas. Collective. @param time at the end of the step [s] @param h its length [s]
  /// @param free positions to which velocities alone lead, ghosts up to date [m]
  /// @param mass of the local particles, of those that move [kg] @param constrained local particles that nothing moves
  void begin_step(double time, double h, const Field& free, const std::vector<double>& mass,
                  const std::vector<bool>& constrained);

  /// Finds the pressures of the gas from the present state of all objects that are linked to it. Collective.
  void choose_pressures();
  /// Velocities that the pressures add to the local particles, (3 x local) [m/s].
  const Field& velocity() const { return velocity_; }
  /// Pressure of each chamber [Pa].
  const Eigen::VectorXd& pressure() const { return pressure_; }

  /// The sheet stays at these positions for the rest of the step, whatever the pressure. Collective. @returns whether
  /// the volumes differ from those where it has settled before, or it had not
  bool fix(const Field& end);
  bool is_fixed() const { return is_fixed_; }
  /// Whether the gas is that of this sheet alone, not linked to other objects.
  bool is_alone() const { return gas_->parts() == 1; }

 private:
  const Sheet& sheet_;
  const Chambers& chambers_;
  const GasStep& gas_step_;
  const Field& start_;
  Field end_;  ///< where the sheet has come to
  bool is_fixed_ = false;
  std::vector<Field> moves_;       ///< h W g of each chamber, (3 x local) [m/(s Pa)]
  FlowingGas::Response response_;  ///< as far as known
  Eigen::VectorXd pressure_;       ///< [Pa]
  Field velocity_;
};

}  // namespace pellicle::world
