#pragma once

#include <memory>
#include <vector>

#include "constraints/constraints.h"
#include "constraints/pins.h"
#include "constraints/point_loads.h"
#include "energies/step_part.h"
#include "equilibrium/time_scheme.h"
#include "prism/prism_elements.h"
#include "prism/prism_options.h"
#include "prism/wall_potential.h"

namespace pellicle::equilibrium {

/// The data of a wall and of the forces on it; all must outlive the holder.
struct WallModel {
  const PrismElements& elements;
  const Constraints& constraints;
  const Pins& pins;
  PointLoads& loads;
  const std::vector<double>& mass;   ///< of the owned vertices [kg]
  Eigen::Vector3d gravity;           ///< [m/s^2]
  std::vector<Potential*> others{};  ///< further potentials of the vertices' positions, which begin a step before
};

/// Start of an implicit step.
struct StepStart {
  const Field* velocity;                       ///< v^n [m/s], ghosts up to date; null: 0
  const std::vector<double>& thickness_ratio;  ///< of the local elements
  double time = 0;                             ///< t^n of the loads [s]
  double h = 0;                                ///< [s]
  const Field* acceleration = nullptr;         ///< a^n [m/s^2], ghosts up to date; null: 0

  Kinematics motion(PetscInt i) const {
    return {velocity != nullptr ? Eigen::Vector3d(velocity->vector(i)) : Eigen::Vector3d::Zero(),
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
};

/// StepPart of a wall: the potential that an implicit step makes stationary, but for that of the gas (balloon paper,
/// eq. 18 to 23; GasFilledPart), with gradient and second derivative,
///
///     Pi(x) = k/2 sum_i m_i |x_i - x_a,i|^2 + c/2 (x - x_v).C (x - x_v) + U(x) - sum_i m_i g.x_i + loads,
///
/// where x is TimeIntegrator's y, and k, c, x_a and x_v are defined there; for implicit Euler they are 1/h^2, 1/h, x^n
/// + h v^n and x^n, and x is x^{n+1}. C = mass_damping M + stiffness_damping K has K at x^n, or with an integrator of
/// second order at the predicted x. U is the elastic energy; without inertia the first term is left out. Eq. 23
/// divided by h^2 is the gradient for implicit Euler.
///
/// Without inertia and damping (TimeIntegrator::is_static) a balloon's rigid motions are constrained by a millionth of
/// the scale of the wall's stiffness.
class WallPart : public PartOfPotentials {
 public:
  /// Collective.
  WallPart(const WallModel& model, const PrismOptions& options, const TimeIntegrator& integrator = {});

  /// Begins a step from `position`; the first x follows from x^n + h v^n with constrained vertices in their places, or
  /// is x^n if an element would turn over or be stretched too far. Collective.
  void begin_step(const Field& position, const StepStart& start);

  /// Forces but those of inertia and gas at a moment, in the directions in which the vertices may move (3 x owned) [N].
  /// Ends the present step. Collective.
  /// @param start whose `h` has no effect: velocities are the present ones
  Eigen::Matrix3Xd forces_at(const Field& position, const StepStart& start);

  /// Work in a step to `end` by the forces at their balance. Collective.
  /// @param start_velocity v^n [m/s] @param of_gas forces of the gas on the owned vertices; empty: there is none [N]
  StepWork work(const Field& end, const Field& start_velocity, const Eigen::Matrix3Xd& of_gas);
  /// This rank's fraction of the work of one potential [J]. Collective.
  double work_of(const Potential& potential, const Field& end) const;

  /// By arc length: changes the time of the loads.
  void set_time(double time);
  /// Sets the pressures on the local elements whose stiffness counts [Pa], and WallPotential's rims. Not collective.
  void set_load(std::vector<double> pressure, const std::vector<PetscInt>& rims);

  /// c [1/s] and x_v [m] of a local vertex, whose velocity at the balance is c (x - x_v).
  double rate() const { return integrator_.rate(h_); }
  Eigen::Vector3d y_v(PetscInt i) const { return y_v_.col(i); }

  const Projectors& projectors() const override { return model_.constraints.projectors; }
  const Field& start() const override { return start_; }
  bool leaves_held_behind() override;
  bool inverts() const override { return true; }
  double inverted(const Field& from, const Field& to) const override;
  bool blends() const override { return wall_.blends(); }
  bool suits_patches() const override { return suits_patches_; }
  double rounding() const override { return rounding_of_inertia_; }

 private:
  void add_vertex_potentials();
  void set_step(const Field& position, const StepStart& start, double fraction);
  void move_held();
  void stop_at_contact();

  WallModel model_;
  PrismOptions options_;
  TimeIntegrator integrator_;
  WallPotential wall_;
  DampingPotential damping_;
  std::unique_ptr<Potential> inertia_;  ///< inertia, or in statics the potential that holds rigid motions; null: none
  std::unique_ptr<Potential> weight_;
  std::unique_ptr<Potential> loads_;  ///< null: no loads
  bool suits_patches_ = false;
  double total_mass_ = 0;           ///< [kg]
  double rounding_of_inertia_ = 0;  ///< norm of the forces of inertia by rounding of positions [N]

  // The present step.
  double h_ = 0;
  double time_end_ = 0;   ///< t^{n+1} [s]
  Field start_;           ///< x^n
  Eigen::Matrix3Xd y_a_;  ///< x_a of the local vertices
  Eigen::Matrix3Xd y_v_;  ///< x_v of the local vertices
};

}  // namespace pellicle::equilibrium
