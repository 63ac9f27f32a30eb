#pragma once

#include <functional>
#include <vector>

#include "energies/potential.h"
#include "energies/step_part.h"
#include "equilibrium/step_gas.h"

namespace pellicle::equilibrium {

/// The stiffness of constant pressures on a surface's triangles: a potential that has only a second derivative by the
/// positions; its value and gradient are those of StepGas. Nothing here communicates.
class PressureStiffness : public Potential {
 public:
  /// The chambers must outlive it.
  explicit PressureStiffness(const Chambers& chambers) : chambers_(chambers) {}

  /// @param pressure on the local triangles [Pa]; empty: none counts
  void set_pressure(std::vector<double> pressure) { pressure_ = std::move(pressure); }

  double value(const Field& /*x*/) const override { return 0; }
  void add_gradient(const Field& /*x*/, Eigen::Matrix3Xd& /*gradient*/) const override {}
  std::vector<VertexPair> pattern() const override;
  void update_hessian(const Field& x, double psd_blend) override;
  void add_hessian(const HessianBlocks& blocks) const override;

 private:
  const Chambers& chambers_;
  std::vector<double> pressure_;
  std::vector<Eigen::Matrix3d> blocks_;  ///< nine of each local triangle; empty where it is left out
};

/// Another part of a step, with gas in the chambers that its surface bounds: the gas's potential W is added to the
/// part's (StepGas). Its second derivative is dense, a stiffness times the product of a volume's gradient with itself:
/// a column for each chamber. For a prescribed chamber with several times the most by which the pressure can fall with
/// the volume beyond a limit point (BorderedSystem).
class GasFilledPart : public ExtendedPart, public GasFilled {
 public:
  /// Takes the pressures on the local triangles whose stiffness the part itself adds to its tangent [Pa]; empty: none
  /// counts.
  using SetLoad = std::function<void(std::vector<double>)>;

  /// All must outlive it. Collective.
  /// @param gas without position and force scale, which are those of the part. What `start` refers to may refer to
  /// nothing before the first step
  /// @param set_load empty: the part knows nothing of pressures, whose stiffness is then a further potential
  GasFilledPart(StepPart& part, StepGas::Part gas, SetLoad set_load = {});

  /// After the part and its chambers have begun theirs. @param pressure of all chambers, where the multipliers start
  /// [Pa] @param time_of_balance at which forces are in balance [s] @param time at the end [s] @param h length of the
  /// step [s]
  void begin_step(const Eigen::VectorXd& pressure, double time_of_balance, double time, double h);
  /// By arc length: changes the time of the loads [s].
  void set_time(double time) {
    time_ = time;
    gas_->set_time(time);
  }
  /// Forces of the gas on the owned vertices at a moment, where the part is (3 x owned) [N]: no gas flows, and links of
  /// chambers have no effect. Collective. @param time [s]
  Eigen::Matrix3Xd forces_at(double time);
  /// Pressures across the walls where the part is [Pa]. Collective.
  Eigen::VectorXd pressures();
  /// Forces of the gas on the owned vertices at the part's positions (3 x owned) [N]. Collective.
  Eigen::Matrix3Xd pressure_forces() { return -gas_->gradient(number_); }
  StepGas::Part gas_part() const override { return own_; }

  bool move_to(const Field& position, const Eigen::VectorXd& own) override;
  Eigen::VectorXd own_unknowns() const override { return multiplier().cwiseQuotient(pressure_scales()); }
  double value() override { return part_.value() + gas_->value(number_); }
  const Eigen::Matrix3Xd& gradient() override;
  const std::vector<double>& squared_forces() const override { return squares_; }
  Eigen::VectorXd own_rows() const override { return -pressure_scales().cwiseProduct(volume_residual()); }
  int columns() const override { return own_.chambers->count(); }
  void begin_tangent(double psd_blend) override;
  LowRank dense_tangent() override { return projected(gas_->begin_tangent(number_, left_), projectors()); }
  double stiffness_scale() override;
  std::vector<int> prescribed() const override { return gas_->prescribed(number_); }
  Eigen::VectorXd pressure_scales() const override { return gas_->pressure_scales(number_); }
  Eigen::VectorXd multiplier() const override { return gas_->multiplier(number_); }
  Eigen::VectorXd volume_residual() const override { return gas_->volume_residual(number_); }
  double rounding() const override { return std::max(part_.rounding(), gas_->rounding(number_)); }

 private:
  StepGas::Part own_;
  SetLoad set_load_;
  PressureStiffness stiffness_;  ///< a potential unless there is `set_load_`
  Eigen::Matrix3Xd gradient_;
  double left_ = 0;  ///< of what is not positive in the tangent, 0 to 1
  std::vector<double> squares_;
};

}  // namespace pellicle::equilibrium
