#pragma once

#include <petscsnes.h>

#include <optional>
#include <string>
#include <vector>

#include "base/handle.h"
#include "constraints/constraints.h"
#include "constraints/pins.h"
#include "constraints/point_loads.h"
#include "gas/chambers.h"
#include "prism/prism_elements.h"
#include "prism/prism_options.h"
#include "prism/prism_tangent.h"
#include "prism/rigid_patches.h"
#include "world/balloon_state.h"

namespace pellicle {

using SnesHandle = Handle<SNES, SNESDestroy>;

/// How an implicit step went.
struct ImplicitResult {
  bool converged = true;
  std::string reason;  ///< of a failure, in words
  int newton_iterations = 0;
  int linear_iterations = 0;
  int concave_iterations = 0;       ///< Newton iterations in which the tangent was not positive definite
  double residual = 0;              ///< norm of what is left of all forces together at the end [N]
  double relative_residual = 0;     ///< over the largest norm of one kind of force: of the wall, the gas, inertia, ...
  bool is_above_tolerance = false;  ///< whether that is more than PrismOptions::residual_tolerance, and not rounding
};

/// What a balloon is made of and what acts on it; all must outlive the step.
struct BalloonModel {
  const PrismElements& elements;
  const Chambers& chambers;
  const Constraints& constraints;
  const Pins& pins;
  PointLoads& loads;
  const std::vector<double>& mass;  ///< of the owned vertices [kg]
  Eigen::Vector3d gravity;          ///< [m/s^2]
  std::string gas_tangent;          ///< GasOptions::tangent
};

/// Implicit Euler for the wall and its gas (balloon paper, eq. 18 to 23), by SNES and KSP with prefix `prism_`.
///
/// The unknowns are the positions x at the end of the step (eq. 23 divided by h^2): the residual is the gradient of
///
///     Pi(x) = sum_i m_i |x_i - x_i^n - h v_i^n|^2 / (2 h^2) + (x - x^n).C (x - x^n) / (2 h)
///             + U(x) + W(V(x)) - sum_i m_i g.x_i + loads,
///
/// with C = mass_damping M + stiffness_damping K(x^n), elastic energy U and the gas's potential W; without inertia the
/// first term is left out. Newton starts from x^n + h v^n (README: readings). Its steps are halved until no element has
/// turned over since x^n and Pi falls. The gas's rank-one part stays low-rank (MatCreateLRC over the assembled or
/// matrix-free part).
///
/// Where the tangent is not positive definite, Pi has no minimum near and may have several further off. Whether it is
/// so the linear solver finds out: conjugate gradients meet a direction of negative curvature, or the solution is one.
/// What they have reached by then depends on preconditioner, ranks and rounding, and is not used: the iteration is
/// solved again with a tangent that is positive definite by construction (TangentInput::positive). So the steps are the
/// same everywhere, and near a minimum the tangent is exact.
///
/// A chamber of prescribed volume adds its pressure as an unknown, the multiplier of V(x) = V*: a bordered system,
/// solved by block elimination with A + rho g g^T in place of A, g = dV/dx, which has the same solution and stays
/// positive definite beyond the limit point of the pressure.
class ImplicitStep {
 public:
  /// Collective. @throws Error on solver options that PETSc does not know
  ImplicitStep(const BalloonModel& model, const PrismOptions& options);

  /// Moves positions (ghosts too) and the pressures of chambers of prescribed volume to `state.time + h`; velocities,
  /// thickness, other pressures, time and step are the caller's. The state is spoilt when the result has not converged.
  /// Collective.
  ImplicitResult advance(BalloonState& state, double h);

  /// Square root of the wall's undeformed area, the same on every rank [m].
  double length_scale() const { return length_scale_; }

 private:
  static PetscErrorCode residual_callback(SNES snes, Vec unknowns, Vec residual, void* context);
  static PetscErrorCode jacobian_callback(SNES snes, Vec unknowns, Mat amat, Mat pmat, void* context);
  static PetscErrorCode line_search_callback(SNESLineSearch search, void* context);
  static PetscErrorCode solve_callback(PC pc, Vec right_hand_side, Vec solution);
  static PetscErrorCode bordered_product_callback(Mat matrix, Vec x, Vec y);

  void read_unknowns(Vec unknowns);
  void set_unknowns(Vec unknowns) const;
  void evaluate_gas();
  void compute_residual(Vec residual);
  enum class Tangent { exact, positive };
  void compute_tangent(Tangent kind);
  void compute_jacobian();
  double potential() const;
  double pressure_scale(int border) const;
  double excess_volume(int border) const;
  double bordering_stiffness(int chamber) const;
  Eigen::VectorXd border_values(Vec vector) const;
  bool search_line(SNESLineSearch search);
  /// no: for another reason than the two that follow, a preconditioner that is not positive definite or could not be
  /// made, and a tangent that is not positive definite.
  enum class Solved { yes, no, bad_preconditioner, concave };
  void solve_newton(Vec right_hand_side, Vec solution);
  Solved solve_once(Vec right_hand_side, Vec solution);
  Solved solve_part(Vec right_hand_side, Vec solution);
  Solved solve_part_directly(Vec right_hand_side, Vec solution);
  Solved run_solver_once(Vec right_hand_side, Vec solution);
  Solved solve_bordered(Vec right_hand_side, Vec solution);
  Solved concave();
  Eigen::MatrixXd gradient_products(const std::vector<Vec>& vectors) const;
  void take_over_settings();
  void multiply_bordered(Vec x, Vec y);
  void make_solver();
  void make_newton(Mat system);
  void require_known_newton() const;
  void judge(SNESConvergedReason reason, ImplicitResult& result);
  std::string words_of_failure(SNESConvergedReason reason) const;

  PetscInt owned() const { return model_.elements.membrane().particles.owned; }
  int bordered() const { return static_cast<int>(bordered_chambers_.size()); }

  BalloonModel model_;
  PrismOptions options_;
  PrismTangent tangent_;
  int rank_ = 0;
  double length_scale_ = 0;             ///< square root of the area [m]
  double force_scale_ = 0;              ///< elastic energy at a strain of 0.5, if linear, over that length [N]
  std::vector<int> bordered_chambers_;  ///< of prescribed volume

  // The step in progress.
  double h_ = 0;
  double time_end_ = 0;
  Field start_;                 ///< x^n
  Field position_;              ///< x
  Field displacement_;          ///< x - x^n, for the stiffness damping
  Eigen::Matrix3Xd predicted_;  ///< x^n + h v^n of the owned vertices
  std::vector<double> thickness_ratio_;
  Eigen::VectorXd volumes_;               ///< of the chambers at `position_`
  std::vector<GasState> gas_;             ///< likewise; of a bordered chamber the pressure is the unknown
  Eigen::VectorXd multiplier_;            ///< pressures of the bordered chambers [Pa]
  std::vector<double> squared_forces_;    ///< this rank's part, each kind of force in the last residual [N^2]
  std::optional<double> start_residual_;  ///< norm at the start of the step [N]
  double rounding_ = 0;                   ///< norm of a residual that is rounding alone [N]
  std::string linear_failure_;
  std::string bad_options_;  ///< why the solver cannot work as the options say, found in a callback
  int linear_iterations_ = 0;
  int concave_iterations_ = 0;

  MatHandle low_rank_;         ///< tangent and gas: Amat of the linear solver
  Eigen::MatrixXd gradients_;  ///< P dV/dx of the chambers, (3 owned x chambers)
  MatHandle gas_columns_;
  MatHandle positive_;  ///< a positive tangent for the preconditioner, once that of the exact one has failed
  VecHandle gas_coefficients_;
  MatHandle bordered_matrix_;
  KspHandle solver_;          ///< of the positions' part, with the gas's low-rank part
  bool solves_once_ = false;  ///< its preconditioner alone, which lacks the low-rank part
  VecHandle part_;            ///< vectors of the positions alone
  VecHandle part_solution_;
  std::vector<VecHandle> influence_;      ///< A^-1 g of the bordered chambers
  std::vector<VecHandle> gas_influence_;  ///< T^-1 g of all chambers, T without the low-rank part
  std::optional<RigidPatches> patches_;   ///< of the preconditioner, if it is multigrid
  VecHandle unknowns_;
  VecHandle residual_;
  SnesHandle snes_;
};

}  // namespace pellicle
