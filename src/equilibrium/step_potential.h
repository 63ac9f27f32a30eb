#pragma once

#include <petscvec.h>

#include <memory>
#include <optional>
#include <vector>

#include "constraints/constraints.h"
#include "constraints/pins.h"
#include "constraints/point_loads.h"
#include "gas/chambers.h"
#include "prism/damping_potential.h"
#include "prism/prism_elements.h"
#include "prism/prism_options.h"
#include "prism/wall_potential.h"
#include "solvers/low_rank_system.h"
#include "solvers/tangent.h"

namespace pellicle {
inline namespace equilibrium {

/// What a balloon is made of and what acts on it; all must outlive who holds it.
struct BalloonModel {
  const PrismElements& elements;
  const Chambers& chambers;
  const Constraints& constraints;
  const Pins& pins;
  PointLoads& loads;
  const std::vector<double>& mass;  ///< of the owned vertices [kg]
  Eigen::Vector3d gravity;          ///< [m/s^2]
  GasTangent gas_tangent;
  std::vector<Potential*> others{};  ///< of its vertices' positions; what else acts on them
};

/// What an implicit step starts from.
struct StepStart {
  const Field& velocity;                       ///< v^n [m/s], ghosts up to date
  const std::vector<double>& thickness_ratio;  ///< of the local elements
  double time = 0;                             ///< t^n [s]
  double h = 0;                                ///< [s]
};

/// What an implicit step makes stationary (balloon paper, eq. 18 to 23), its gradient and its second derivative:
///
///     Pi(x) = sum_i m_i |x_i - x_i^n - h v_i^n|^2 / (2 h^2) + (x - x^n).C (x - x^n) / (2 h)
///             + U(x) + W(V(x)) - sum_i m_i g.x_i + loads,
///
/// with C = mass_damping M + stiffness_damping K(x^n), elastic energy U and the gas's potential W; without inertia the
/// first term is left out. Eq. 23 divided by h^2 is its gradient. Of a chamber with a hole, whose pressure is given, W
/// is minus the work on what is left of the wall, straight from x^n to x; a follower load has no potential.
///
/// It is a sum of potentials: wall, inertia, damping, weight, loads and the model's others. The gas stands beside them,
/// since its second derivative is dense: a stiffness times the product of a volume's gradient with itself.
///
/// A chamber of prescribed volume has no W: its pressure p is the multiplier of V(x) = V*, an unknown beside x, as p
/// over its pressure scale, and the row of the residual is that scale times V* - V(x).
class StepPotential {
 public:
  /// Collective.
  StepPotential(const BalloonModel& model, const PrismOptions& options);
  StepPotential(const StepPotential&) = delete;
  StepPotential& operator=(const StepPotential&) = delete;

  /// From here on Pi is that of the step from `position`, which goes on at x^n + h v^n with held vertices in their
  /// places; at x^n alone if that turns an element over or is more than one can bear. Collective.
  /// @param pressure of all chambers, where the multipliers start [Pa]
  void begin_step(const Field& position, const Eigen::VectorXd& pressure, const StepStart& start);

  /// Goes to unknowns: positions of the owned vertices, then on rank 0 the multipliers over their scales. Collective.
  void move_to(Vec unknowns);
  void write_to(Vec unknowns) const;

  /// x, ghosts up to date.
  const Field& position() const { return position_; }
  /// Of the prescribed chambers [Pa].
  const Eigen::VectorXd& multiplier() const { return multiplier_; }

  /// Pi at x [J]. Collective.
  double value();
  /// V(x) - V* of the prescribed chambers when Pi or the residual was last asked for [m^3].
  Eigen::VectorXd excess_volume() const;
  /// Elements that have turned over since x^n, on all ranks. Collective.
  double inverted() const;
  /// Gradient of Pi at x, and the rows of the multipliers. Collective.
  void compute_residual(Vec residual);
  /// Norms of the forces of each potential and of the gas in the last residual [N]. Collective.
  std::vector<double> force_norms() const;
  /// See Tangent::renew_pattern.
  bool renew_pattern() { return tangent_->renew_pattern(); }
  /// Sets the sparse part of the second derivative at x, and as low-rank part the volumes' gradients g with the gas's
  /// stiffness; of a prescribed chamber with several times what the pressure can fall with the volume beyond a limit
  /// point (BorderedSystem). Collective.
  /// @param system of `tangent_matrix`, with a column a chamber
  void update_tangent(Curvature curvature, LowRankSystem& system);

  Mat tangent_matrix() const { return tangent_->matrix(); }
  const Tangent& tangent() const { return *tangent_; }
  /// The chambers of prescribed volume.
  const std::vector<int>& prescribed() const { return prescribed_; }
  /// Of their pressures, in the unknowns [Pa].
  Eigen::VectorXd pressure_scales() const;
  /// Square root of the wall's undeformed area [m].
  double length_scale() const { return length_scale_; }
  /// The elastic energy at a strain of 0.5, if linear, over that length: what the wall's forces are like [N].
  double force_scale() const { return force_scale_; }

 private:
  void add_vertex_potentials();
  void evaluate_gas();
  double work_on_rest(int chamber);
  double bordering_stiffness(int chamber) const;
  PetscInt owned() const { return model_.elements.membrane().particles.owned; }
  MPI_Comm comm() const { return model_.elements.membrane().comm(); }

  BalloonModel model_;
  PrismOptions options_;
  WallPotential wall_;
  DampingPotential damping_;
  std::vector<std::unique_ptr<Potential>> of_vertices_;  ///< inertia, weight, loads
  std::vector<Potential*> potentials_;                   ///< all of them
  std::optional<Tangent> tangent_;
  int rank_ = 0;
  double length_scale_ = 0;
  double force_scale_ = 0;
  std::vector<int> prescribed_;

  // The step in progress.
  double h_ = 0;
  double time_end_ = 0;
  Field start_;                         ///< x^n
  Field position_;                      ///< x
  Field between_;                       ///< on the way from x^n to x
  Eigen::Matrix3Xd predicted_;          ///< x^n + h v^n of the owned vertices
  Eigen::VectorXd volumes_;             ///< of the chambers at `position_`
  std::vector<GasState> gas_;           ///< likewise; of a prescribed chamber the pressure is the unknown
  Eigen::VectorXd multiplier_;          ///< pressures of the prescribed chambers [Pa]
  std::vector<double> squared_forces_;  ///< this rank's part, in the last residual [N^2]
};

}  // namespace equilibrium
}  // namespace pellicle
