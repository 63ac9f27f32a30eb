#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "constraints/constraints.h"
#include "constraints/pins.h"
#include "constraints/point_loads.h"
#include "contact/body_contact.h"
#include "energies/potential_sum.h"
#include "energies/step_part.h"
#include "equilibrium/step_gas.h"
#include "equilibrium/time_scheme.h"
#include "gas/chambers.h"
#include "prism/damping_potential.h"
#include "prism/prism_elements.h"
#include "prism/prism_options.h"
#include "prism/wall_potential.h"

namespace pellicle {
inline namespace equilibrium {

/// The data of a balloon and of the forces on it; all must outlive the holder.
struct BalloonModel {
  const PrismElements& elements;
  const Chambers& chambers;
  const GasStep& gas_step;  ///< data of the chambers' gas, which may change between calls
  const Constraints& constraints;
  const Pins& pins;
  PointLoads& loads;
  const std::vector<double>& mass;  ///< of the owned vertices [kg]
  Eigen::Vector3d gravity;          ///< [m/s^2]
  GasTangent gas_tangent;
  std::vector<Potential*> others{};  ///< further potentials of the vertices' positions
  BodyContact* bodies = nullptr;     ///< that press on the balloon; null: none
};

/// Start of an implicit step.
struct StepStart {
  const Field& velocity;                       ///< v^n [m/s], ghosts up to date
  const std::vector<double>& thickness_ratio;  ///< of the local elements
  double time = 0;                             ///< t^n; by arc length the loads' time [s]
  double h = 0;                                ///< [s]
  const Field* acceleration = nullptr;         ///< a^n [m/s^2], ghosts up to date; null: 0
  const Field* direction = nullptr;            ///< by arc length: of the path, from StepPotential::write_direction

  Kinematics motion(PetscInt i) const {
    return {velocity.vector(i),
            acceleration != nullptr ? Eigen::Vector3d(acceleration->vector(i)) : Eigen::Vector3d::Zero()};
  }
};

/// Work of the forces on a wall over the displacements of a step, of all ranks [J].
struct StepWork {
  double gravity = 0;
  double damping = 0;
  double pins = 0;
  double pressure = 0;
  double loads = 0;
  double bodies = 0;
};

/// StepPart of a balloon: the potential that an implicit step makes stationary (balloon paper, eq. 18 to 23), with
/// gradient and second derivative,
///
///     Pi(x) = k/2 sum_i m_i |x_i - x_a,i|^2 + c/2 (x - x_v).C (x - x_v) + U(x) + W(V(x)) - sum_i m_i g.x_i + loads,
///
/// where x is TimeIntegrator's y, and k, c, x_a and x_v are defined there; for implicit Euler they are 1/h^2, 1/h, x^n
/// + h v^n and x^n, and x is x^{n+1}. C = mass_damping M + stiffness_damping K has K at x^n, or with an integrator of
/// second order at the predicted x. U is the elastic energy, W the gas's potential; without inertia the first term is
/// left out. Eq. 23 divided by h^2 is the gradient for implicit Euler.
///
/// Pi is a sum of potentials: wall, inertia, damping, weight, loads, bodies and the model's others. The gas (StepGas)
/// is separate, since its second derivative is dense: a stiffness times the product of a volume's gradient with itself.
///
/// Without inertia and damping (TimeIntegrator::is_static) a balloon's rigid motions are constrained by a millionth of
/// the scale of the wall's stiffness. By arc length the loads' time t is an unknown, too: the row of the residual is a
/// scale times sum_i w_i c_i.(x_i - x_i^n) - s (Riks), with the direction c of the path, s the length of the step on it
/// and w the vertices' fractions of the mass. c and lengths include free motions only.
class StepPotential : public StepPart, public GasFilled {
 public:
  /// Collective.
  StepPotential(const BalloonModel& model, const PrismOptions& options, const TimeIntegrator& integrator = {});
  StepPotential(const StepPotential&) = delete;
  StepPotential& operator=(const StepPotential&) = delete;

  /// Begins a step from `position`; the first x follows from x^n + h v^n with constrained vertices in their places, or
  /// is x^n if an element would turn over or be stretched too far. Collective.
  /// @param pressure of all chambers, from which the multipliers start [Pa]
  void begin_step(const Field& position, const Eigen::VectorXd& pressure, const StepStart& start);

  /// Accelerations that balance all other forces at a moment, 0 of constrained vertices (3 x owned) [m/s^2]. Ends the
  /// present step. Collective.
  /// @param start whose `h` is used for friction alone, as the time of motion at the present velocities
  Eigen::Matrix3Xd acceleration(const Field& position, const StepStart& start);

  StepGas::Part gas_part() const override {
    StepGas::Part part{"", &model_.chambers, &model_.gas_step, &start_, &position_, model_.gas_tangent, force_scale_};
    part.write_end = [this](Field& position) { write_end(position); };
    return part;
  }
  void share_gas(std::shared_ptr<StepGas> gas, std::size_t part) override {
    gas_ = std::move(gas);
    part_ = part;
  }
  GasExchange end_gas(const Field& end) override { return gas_->end_step(part_, end, time_end_, h_); }

  /// Work in a step to `end` by the forces at their balance; to be called before `end_gas`. Collective.
  /// @param start_velocity v^n [m/s]
  StepWork work(const Field& end, const Field& start_velocity);
  /// This rank's fraction of the work of one potential [J]. Collective.
  double work_of(const Potential& potential, const Field& end) const;

  /// Time at which forces are in balance; by arc length the loads' time [s].
  double time() const { return time_; }
  /// By arc length: the derivative of the residual by the loads' time, of the owned vertices [N/s]. Collective.
  Eigen::VectorXd load_rate() override;
  /// By arc length: scale of the residual's additional row [N/m].
  double path_scale() const override { return force_scale_ / length_scale_; }
  bool follows_path() const override { return integrator_.arc_length().has_value(); }
  bool suits_patches() const override { return suits_patches_; }
  /// By arc length: direction c, of all local vertices, from the start of this step to `position`, with root mean
  /// square 1. Collective.
  void write_direction(const Field& position, Field& direction) const;

  /// Moves positions (ghosts too) and the pressures of chambers of prescribed volume to the end of the step.
  /// Collective. @returns message if the balance is not the end of a step; otherwise empty
  std::string end_step(Field& position, Eigen::VectorXd& pressure) const;
  /// Writes x^{n+1}, which follows from x (TimeIntegrator), with constrained vertices in their places; ghosts up to
  /// date. Not collective.
  void write_end(Field& position) const;
  /// c [1/s] and x_v [m] of a local vertex, whose velocity at the balance is c (x - x_v).
  double rate() const { return integrator_.rate(h_); }
  Eigen::Vector3d y_v(PetscInt i) const { return y_v_.col(i); }

  const Layout& vertices() const override { return model_.elements.membrane().particles; }
  const std::vector<std::array<PetscInt, 3>>& triangles() const override {
    return model_.elements.membrane().triangles;
  }
  const Projectors& projectors() const override { return model_.constraints.projectors(); }
  const std::vector<Potential*>& potentials() const override { return potentials_; }

  const Field& start() const override { return start_; }
  const Field& position() const override { return position_; }
  /// @param own the multipliers over their scales, or by arc length the loads' time
  void move_to(const Field& position, const Eigen::VectorXd& own) override;
  void forget() override { sum_.forget(); }
  Eigen::VectorXd own_unknowns() const override;
  bool leaves_held_behind() override;

  double value() override;
  const Eigen::Matrix3Xd& gradient() override;
  const std::vector<double>& squared_forces() const override { return squared_forces_; }
  Eigen::VectorXd own_rows() override;
  bool inverts() const override { return true; }
  double inverted(const Field& from, const Field& to) const override;

  /// A column for each chamber, the volume's gradient, with the gas's stiffness; for a prescribed chamber with several
  /// times the most by which the pressure can fall with the volume beyond a limit point (BorderedSystem). By arc length
  /// one more column, for the additional row.
  int columns() const override { return model_.chambers.count() + (integrator_.arc_length() ? 1 : 0); }
  void begin_tangent(Curvature curvature, double psd_blend) override;
  LowRank dense_tangent() override;
  bool blends() const override { return wall_.blends(); }

  std::vector<int> prescribed() const override { return gas_->prescribed(part_); }
  Eigen::VectorXd pressure_scales() const override { return gas_->pressure_scales(part_); }
  Eigen::VectorXd multiplier() const override { return gas_->multiplier(part_); }
  Eigen::VectorXd volume_residual() const override { return gas_->volume_residual(part_); }

  double tolerance() const override { return options_.snes_rtol; }
  /// Square root of the wall's undeformed area [m].
  double length_scale() const override { return length_scale_; }
  /// The elastic energy at a strain of 0.5, if linear, over that length: scale of the wall's forces [N].
  double force_scale() const override { return force_scale_; }
  double rounding() const override { return std::max(gas_->rounding(part_), rounding_of_inertia_); }

 private:
  void add_vertex_potentials();
  void set_step(const Field& position, const StepStart& start, double fraction);
  void move_held();
  void set_load_time();
  void stop_at_contact();
  void begin_path(const StepStart& start);
  double along_path() const;
  void set_unit_length(Field& direction) const;
  void evaluate() { sum_.evaluate(potentials_, model_.constraints.projectors(), position_, owned()); }
  PetscInt owned() const { return model_.elements.membrane().particles.owned; }
  MPI_Comm comm() const { return model_.elements.membrane().comm(); }

  BalloonModel model_;
  PrismOptions options_;
  TimeIntegrator integrator_;
  WallPotential wall_;
  DampingPotential damping_;
  std::unique_ptr<Potential> inertia_;  ///< inertia, or in statics the potential that holds rigid motions; null: none
  std::unique_ptr<Potential> weight_;
  std::unique_ptr<Potential> loads_;    ///< null: no loads
  std::vector<Potential*> potentials_;  ///< all potentials
  double length_scale_ = 0;
  double force_scale_ = 0;
  bool suits_patches_ = false;
  double total_mass_ = 0;           ///< [kg]
  double rounding_of_inertia_ = 0;  ///< norm of the forces of inertia by rounding of positions [N]
  std::shared_ptr<StepGas> gas_;
  std::size_t part_ = 0;  ///< number of this part in the gas

  // The present step.
  double h_ = 0;
  double time_end_ = 0;     ///< t^{n+1} [s]
  double time_ = 0;         ///< time of balance [s]
  Field start_;             ///< x^n
  Field position_;          ///< x
  Eigen::Matrix3Xd y_a_;    ///< x_a of the local vertices
  Eigen::Matrix3Xd y_v_;    ///< x_v of the local vertices
  Field direction_;         ///< c, if by arc length
  double path_length_ = 0;  ///< s [m]
  double left_ = 0;         ///< fraction of the indefinite terms kept in the tangent, 0 to 1

  PotentialSum sum_;                    ///< of the potentials at `position_`, without the gas
  Eigen::Matrix3Xd with_gas_;           ///< gradient of the potentials and the gas (3 x owned) [N]
  std::vector<double> squared_forces_;  ///< of each potential, and of the gas last: this rank's part [N^2]
};

}  // namespace equilibrium
}  // namespace pellicle
