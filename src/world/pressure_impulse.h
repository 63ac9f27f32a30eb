#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "equilibrium/step_gas.h"
#include "parallel/field.h"
#include "surface/sheet.h"

namespace pellicle::world {

/// The gas in a sheet that PressureImpulse moves, its own or one with that in chambers of other objects.
class GasCoupling : public GasFilled {
 public:
  /// All must outlive it. @param start positions at the beginning of a step @param end at its end, and until the sheet
  /// has moved those at the beginning
  GasCoupling(const Chambers& chambers, const GasStep& gas_step, const Field& start, const Field& end)
      : chambers_(chambers), gas_step_(gas_step), start_(start), end_(end) {
    gas_ = std::make_shared<StepGas>(std::vector<StepGas::Part>{gas_part()});
  }

  StepGas::Part gas_part() const override {
    return {"", &chambers_, &gas_step_, &start_, &end_, GasTangent::exact, 0, {}, true};
  }
  /// Begins the step of the gas. @param time at the end of the step [s] @param h its length [s]
  void begin_step(double time, double h) {
    time_ = time;
    h_ = h;
    gas_->begin_step(time);
  }

  const Chambers& chambers() const { return chambers_; }
  StepGas& gas() { return *gas_; }
  /// Whether the gas is that of this sheet alone, not linked to other objects.
  bool is_alone() const { return gas_->parts() == 1; }
  /// Number of the sheet among the parts of the gas.
  std::size_t number() const { return number_; }

 private:
  const Chambers& chambers_;
  const GasStep& gas_step_;
  const Field& start_;
  const Field& end_;
};

/// The gas in a projected sheet in a step: h W g p is added to its velocities before the projection, with the volume's
/// gradient g, the inverse masses W of the particles that are not constrained, and the pressure p.
///
/// The pressure is that of the law at the volume to which it would push the sheet if that had no springs, whose
/// response is known (h^2 g.W g): projected springs have no stiffness that would answer a pressure in proportion.
/// Chambers of other objects that are linked to the gas see the volume as the projection has left it. In a sheet of one
/// layer the forces on the centres of cells act on the corners of the cells.
class PressureImpulse {
 public:
  /// Gas and sheet must outlive it. Collective.
  /// @param free positions to which velocities alone lead, ghosts up to date [m]
  /// @param mass of the local particles, of those that move [kg] @param constrained local particles that nothing moves
  /// @param h length of the step, which the gas has begun [s]
  PressureImpulse(GasCoupling& gas, const Sheet& sheet, const Field& free, const std::vector<double>& mass,
                  const std::vector<bool>& constrained, double h);

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

 private:
  GasCoupling& gas_;
  const Chambers& chambers_;
  bool is_fixed_ = false;
  std::vector<Field> moves_;       ///< h W g of each chamber, (3 x local) [m/(s Pa)]
  FlowingGas::Response response_;  ///< as far as known
  Eigen::VectorXd pressure_;       ///< [Pa]
  Field velocity_;
};

}  // namespace pellicle::world
