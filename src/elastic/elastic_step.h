#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/stage_result.h"
#include "base/stop_signal.h"
#include "elastic/bending_potential.h"
#include "elastic/elastic_options.h"
#include "elastic/mass_part.h"
#include "elastic/spring_potential.h"
#include "parallel/field.h"
#include "solvers/ksp.h"
#include "solvers/preconditioner_lag.h"
#include "solvers/rigid_patches.h"
#include "solvers/step_part.h"
#include "solvers/tangent.h"

namespace pellicle {
inline namespace elastic {

/// What a step of the elastic sheet needs besides the positions that it moves.
struct ElasticInput : MassInput {
  const std::array<std::vector<double>, 4>& target_length;  ///< of the local springs of each colour [m]
  const std::vector<double>& shrinkage;                     ///< length over undeformed length of each local particle
  const std::vector<double>& stiffness_factor;              ///< of each local particle, such as of char
  const Living& living;                                     ///< what has not burnt, ghosts up to date
};

/// How a step of the elastic sheet went.
struct ElasticResult : StageResult {
  int newton_iterations = 0;  ///< each of them has a linear solve
};

/// Implicit Euler for a sheet as a material: from the unconstrained positions x~ (burning paper, eq. 9) it finds
///
///     x = argmin sum_i m_i |x_i - x~_i|^2 / (2 h^2) + U_springs(x) + U_bending(x),
///
/// with viscosity as springs and bending relative to the step's start. Newton's method with positive tangents and a
/// line search, so that the sum falls with every iteration; KSP prefix `elastic_`.
///
/// With a strain limit (StrainLimit) the sum is minimised with the limit's energy continued smoothly beyond a share of
/// it, and again with a larger share, until no spring is beyond that share, where the energy is the exact one. So a
/// step may start beyond the limit. A step that ends beyond it has not converged.
///
/// Its springs shrink with the mean of its layers; the difference between the layers bends it.
///
/// Together with what it touches the sheet is a StepPart: its step is begun here, and brought into balance elsewhere.
class ElasticStep : public MassPart {
 public:
  /// The sheet must outlive it. Collective.
  /// @param layer_distance see BendingPotential @param factors of the material's textures
  /// @param pinned local particles that are never to move @param clamped those of the pinned at which an edge keeps its
  /// direction @param others what else acts on the particles' positions; must outlive it
  ElasticStep(const Sheet& sheet, const SheetMaterial& material, double layer_distance, const MaterialFactors& factors,
              const std::vector<bool>& pinned, const std::vector<bool>& clamped, const ElasticOptions& options,
              const std::vector<Potential*>& others = {});

  ElasticStep(const ElasticStep&) = delete;  // Its potentials point to it.
  ElasticStep& operator=(const ElasticStep&) = delete;

  /// Collective.
  /// @param positions in: x~ [m], pinned particles in their places; out: at the end of the step. Ghosts up to date.
  /// `error` of the result is the residual, over the largest norm of a kind of force.
  ElasticResult advance(Field& positions, const ElasticInput& input);

  /// Sets lengths and stiffness as a step has them. Not collective.
  void set_shape(const ElasticInput& input);
  /// Begins a step that is brought into balance elsewhere, where its strain limit has to be checked. Collective.
  /// @param positions x~ [m], pinned particles in their places; ghosts up to date
  void begin(const Field& positions, const ElasticInput& input);
  LowRank begin_tangent(Curvature /*curvature*/, double positive_share) override {
    springs_.set_positive_share(positive_share);
    return {};
  }

  double rounding() const override { return rounding_of(rest_stiffness_ + mean_mass_ / (h_ * h_)); }
  /// Describes its solver, such as "cg, pbjacobi: stiffness is 130 times inertia".
  const std::string& solver_words() const { return solver_words_; }

  /// See SheetSprings::largest_excess; the largest of all ranks. Collective.
  double largest_excess() const;

  /// Whether the owned springs of each colour have stiffness, see SheetSprings. Not collective.
  std::array<std::vector<bool>, 4> bearing_springs(const Living& living);

  /// Forces of the owned springs by colour at some positions, with the lengths and stiffness of the last step, positive
  /// where they pull [N]. Not collective.
  std::array<std::vector<double>, 4> spring_forces(const Field& positions) const { return springs_.forces(positions); }

  /// Energy of springs and bending at some positions, with the lengths and stiffness of the last step and without
  /// viscosity. Collective.
  double elastic_energy(const Field& positions) const;
  /// What resists changes of its shape, viscosity included.
  std::array<const Potential*, 2> of_shape() const { return {&springs_, &bending_}; }
  /// Work of viscosity in the last step, which has led to these positions, at most 0. Collective. [J]
  double viscous_work(const Field& positions) const;

 private:
  ElasticStep(const Sheet& sheet, const Stiffness& stiffness, const Weave& weave, const MaterialFactors& factors,
              const std::vector<bool>& pinned, const std::vector<bool>& clamped, const ElasticOptions& options,
              const std::vector<Potential*>& others);
  void make_solver();
  /// Figures of the diagonal of the undeformed sheet's tangent.
  struct RestTangent {
    double mean_square = 0;   ///< root of the mean of its squares [N/m]
    double over_inertia = 0;  ///< mean, over the mean of its inertia
  };
  RestTangent rest_tangent();  // collective
  /// Newton's method, from the positions given, until no potential asks for more (Potential::renew). Adds to the
  /// iterations of `result`. Collective.
  void settle(Field& positions, const ElasticInput& input, ElasticResult& result);
  void minimise(Field& positions, const ElasticInput& input, ElasticResult& result);
  void forget_pattern();
  /// Newton's step with the exact tangent if that is wanted and positive definite, otherwise with the positive one.
  LinearResult find_update(const Field& positions, bool is_exact);
  /// Of all ranks.
  struct Forces {
    double energy = 0;        ///< [J]
    double norm = 0;          ///< of the gradient [N]
    double largest_part = 0;  ///< norm of the largest contribution of a potential to it [N]
  };
  /// Fills gradient_. Collective.
  Forces compute_forces(const Field& x, const std::vector<bool>& held);

  const Sheet& sheet_;
  ElasticOptions options_;
  double layer_distance_ = 0;
  double damping_ = 0;
  std::array<double, 2> bending_stiffness_;
  std::vector<double> bending_factor_;  ///< of the local particles
  std::optional<StrainLimit> limit_;
  SheetSprings material_;
  SpringPotential springs_;
  BendingPotential bending_;
  bool limits_ = false;                 ///< one of them bounds steps
  std::unique_ptr<Tangent> tangent_;    ///< matrix-free
  std::unique_ptr<Tangent> assembled_;  ///< an earlier one, to make the preconditioner from; null: from `tangent_`
  PreconditionerLag lag_;
  double rest_stiffness_ = 0;  ///< RestTangent::mean_square
  KspHandle solver_;
  std::string solver_words_;
  std::unique_ptr<RigidPatches> patches_;  ///< of the preconditioner, if it is multigrid
  VecHandle residual_;
  VecHandle update_;
  Eigen::Matrix3Xd gradient_;
  std::vector<double> sums_;  ///< energy, squares of the norms of the gradient and its parts
  Eigen::Matrix3Xd step_;     ///< of Newton's method
  StopPoint stop_;            ///< in each of its iterations

  std::vector<double> bent_factor_;  ///< on the bending stiffness of the local particles in the present step, with char
};

}  // namespace elastic
}  // namespace pellicle
