#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "equilibrium/step_gas.h"
#include "parallel/field.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace world {

/// The gas in a sheet that GasPush moves, its own or one with that in chambers of other objects.
class PushedGas : public GasFilled {
 public:
  /// All must outlive it. @param start positions at the beginning of a step @param end at its end, and until the sheet
  /// has moved those at the beginning
  PushedGas(const Chambers& chambers, const Field& start, const Field& end)
      : chambers_(chambers),
        start_(start),
        end_(end),
        gas_(std::make_shared<StepGas>(std::vector<StepGas::Part>{gas_part()})) {}

  StepGas::Part gas_part() const override { return {"", &chambers_, &start_, &end_, GasTangent::exact, 0, {}, true}; }
  void share_gas(std::shared_ptr<StepGas> gas, std::size_t part) override {
    gas_ = std::move(gas);
    number_ = part;
  }

  const Chambers& chambers() const { return chambers_; }
  StepGas& gas() { return *gas_; }
  /// Whether it is joined to nothing but what the sheet encloses.
  bool is_alone() const { return gas_->parts() == 1; }
  /// Of the sheet among the parts of the gas.
  std::size_t number() const { return number_; }

 private:
  const Chambers& chambers_;
  const Field& start_;
  const Field& end_;
  std::shared_ptr<StepGas> gas_;
  std::size_t number_ = 0;
};

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
  /// Gas and sheet must outlive it. Collective.
  /// @param free positions to which velocities alone lead, ghosts up to date [m]
  /// @param mass of the local particles, of those that move [kg] @param held local particles that nothing moves
  /// @param h length of the step, which the gas has begun [s]
  GasPush(PushedGas& gas, const Sheet& sheet, const Field& free, const std::vector<double>& mass,
          const std::vector<bool>& held, double h);

  /// Takes the pressures of the gas, with all that it is joined to as it is by now. Collective.
  void choose_pressures();
  /// What they add to the velocities of the local particles, (3 x local) [m/s].
  const Field& velocity() const { return velocity_; }
  /// Of each chamber [Pa].
  const std::vector<double>& pressure() const { return pressure_; }

  /// Whether the step that has led to these positions is the last try: it agrees with the laws, or enough others have
  /// not. If not, pressures are to be chosen anew. Collective.
  bool is_done(const Field& end);
  /// The sheet stays at these positions for the rest of the step, whatever the pressure. Collective.
  void settle(const Field& end);
  bool has_settled() const { return has_settled_; }
  /// In words, how the last try does not agree with a law; empty: it does.
  const std::string& disagreement() const { return disagreement_; }

 private:
  PushedGas& gas_;
  const Chambers& chambers_;
  int solves_ = 0;
  bool has_settled_ = false;
  std::string disagreement_;
  std::vector<Field> moves_;           ///< h W g of each chamber, (3 x local) [m/(s Pa)]
  FlowingGas::Response response_;      ///< as far as known
  Eigen::VectorXd free_compliance_;    ///< without springs
  std::vector<double> pressure_;       ///< [Pa]
  Eigen::VectorXd expected_;           ///< W at which the laws give them [m^3]
  std::vector<double> last_pressure_;  ///< of the solve before
  Eigen::VectorXd last_volume_;        ///< W to which it has led
  Field velocity_;
};

}  // namespace world
}  // namespace pellicle
