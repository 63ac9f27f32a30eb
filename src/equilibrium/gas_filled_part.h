#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "energies/potential.h"
#include "equilibrium/step_gas.h"

namespace pellicle {
inline namespace equilibrium {

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
  void set_psd_blend(double fraction) override { psd_blend_ = fraction; }
  void update_hessian(const Field& x, Curvature curvature) override;
  void add_hessian(const HessianBlocks& blocks) const override;

 private:
  const Chambers& chambers_;
  double psd_blend_ = 0;
  std::vector<double> pressure_;
  std::vector<Eigen::Matrix3d> blocks_;  ///< nine of each local triangle; empty where it is left out
};

/// Another part of a step, with gas in the chambers that its surface bounds.
class GasFilledPart : public StepPart, public GasFilled {
 public:
  /// All must outlive it. Collective.
  /// @param gas_step data of its gas, which may change between calls
  /// @param start what the part's `start` refers to in every step; before the first one it may refer to nothing
  /// @param write_end see StepGas::Part
  GasFilledPart(StepPart& part, const Chambers& chambers, const GasStep& gas_step, const Field& start,
                GasTangent tangent, std::function<void(Field&)> write_end = {});

  /// After the part and its chambers have begun theirs. @param pressure of all chambers, where the multipliers start
  /// [Pa] @param time at the end [s] @param h length of the step [s] @param fraction of it at which forces are in
  /// balance
  void begin_step(const Eigen::VectorXd& pressure, double time, double h, double fraction = 1);
  /// Forces of the gas on the owned vertices at a moment, where the part is (3 x owned) [N]: no gas flows, and links of
  /// chambers have no effect. Collective. @param time [s]
  Eigen::Matrix3Xd forces_at(double time);
  /// Pressures across the walls where the part is [Pa]. Collective.
  Eigen::VectorXd pressures();
  /// Forces of the gas on the owned vertices at the part's positions (3 x owned) [N]. Collective.
  Eigen::Matrix3Xd pressure_forces() { return -gas_->gradient(number_); }
  GasExchange end_gas(const Field& end) override { return gas_->end_step(number_, end, time_, h_); }

  StepGas::Part gas_part() const override {
    return {"", &chambers_, &gas_step_, &start_, &part_.position(), tangent_, part_.force_scale(), write_end_};
  }
  void share_gas(std::shared_ptr<StepGas> gas, std::size_t part) override {
    gas_ = std::move(gas);
    number_ = part;
  }

  const Layout& vertices() const override { return part_.vertices(); }
  const std::vector<std::array<PetscInt, 3>>& triangles() const override { return part_.triangles(); }
  const Projectors& projectors() const override { return part_.projectors(); }
  const std::vector<Potential*>& potentials() const override { return potentials_; }
  const Field& start() const override { return part_.start(); }
  const Field& position() const override { return part_.position(); }
  void move_to(const Field& position, const Eigen::VectorXd& own) override;
  Eigen::VectorXd own_unknowns() const override { return multiplier().cwiseQuotient(pressure_scales()); }
  void forget() override { part_.forget(); }
  bool leaves_held_behind() override { return part_.leaves_held_behind(); }
  double value() override { return part_.value() + gas_->value(number_); }
  const Eigen::Matrix3Xd& gradient() override;
  const std::vector<double>& squared_forces() const override { return squares_; }
  Eigen::VectorXd own_rows() override { return -pressure_scales().cwiseProduct(volume_residual()); }
  bool inverts() const override { return part_.inverts(); }
  double inverted(const Field& from, const Field& to) const override { return part_.inverted(from, to); }
  int columns() const override { return chambers_.count(); }
  void begin_tangent(Curvature curvature, double psd_blend) override;
  LowRank dense_tangent() override;
  bool blends() const override { return part_.blends(); }
  bool suits_patches() const override { return part_.suits_patches(); }
  std::vector<int> prescribed() const override { return gas_->prescribed(number_); }
  Eigen::VectorXd pressure_scales() const override { return gas_->pressure_scales(number_); }
  Eigen::VectorXd multiplier() const override { return gas_->multiplier(number_); }
  Eigen::VectorXd volume_residual() const override { return gas_->volume_residual(number_); }
  double tolerance() const override { return part_.tolerance(); }
  double length_scale() const override { return part_.length_scale(); }
  double force_scale() const override { return part_.force_scale(); }
  double rounding() const override { return std::max(part_.rounding(), gas_->rounding(number_)); }

 private:
  StepPart& part_;
  const Chambers& chambers_;
  const GasStep& gas_step_;
  const Field& start_;
  GasTangent tangent_;
  std::function<void(Field&)> write_end_;
  PressureStiffness stiffness_;
  std::vector<Potential*> potentials_;
  std::shared_ptr<StepGas> gas_;
  std::size_t number_ = 0;  ///< of the part of the gas
  double time_ = 0;         ///< at the end of the step [s]
  double h_ = 0;            ///< its length [s]
  Eigen::Matrix3Xd gradient_;
  double left_ = 0;  ///< of what is not positive in the tangent, 0 to 1
  std::vector<double> squares_;
};

}  // namespace equilibrium
}  // namespace pellicle
