#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "base/handle.h"
#include "base/stage_result.h"
#include "parallel/field.h"
#include "surface/living.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace base {
class OptionTable;
}  // namespace base
inline namespace projection {

struct SpringOptions {
  /// Prefix of PETSc's options for these solvers; in a run of several objects `objects_NAME_` stands before it.
  std::string solver_prefix = "spring_";
  double stiffness = 100;          ///< k of every spring [N/m]
  double damping = 0;              ///< c/k of the dashpot beside every spring [s]
  int newton_steps = 10;           ///< linear solves a time step, at most
  double newton_tolerance = 1e-4;  ///< update at which Newton's method ends, as a share of the mean spring length
};

void describe(OptionTable& table, SpringOptions& options);

/// What one step of the mass-spring sheet needs besides the positions that it moves.
struct SpringInput {
  const std::array<std::vector<double>, 4>& target_length;  ///< l of the local springs of each colour [m]
  const std::vector<double>& mass;  ///< of the local particles, 0 where one has been removed [kg]
  const std::vector<bool>& pinned;  ///< local particles that the springs must not move
  const Living& living;             ///< what has not burnt, ghosts up to date
  const Field& start;               ///< positions at the beginning of the step [m]
  double h = 0;                     ///< [s]
  /// D of the owned particles, by which a linear drag -D v resists their velocities [N s/m]; null: nothing does.
  const std::vector<Eigen::Matrix3d>* resistance = nullptr;

  /// (m + h D)/h^2 of an owned particle: what resists leaving x~, to which drag has led, too [N/m].
  Eigen::Matrix3d inertia(PetscInt i) const {
    const Eigen::Matrix3d inertia = mass[static_cast<std::size_t>(i)] / (h * h) * Eigen::Matrix3d::Identity();
    return resistance == nullptr || mass[static_cast<std::size_t>(i)] == 0
               ? inertia
               : Eigen::Matrix3d(inertia + (*resistance)[static_cast<std::size_t>(i)] / h);
  }
};

/// The mass-spring sheet that successive fast projection is compared with (burning paper, section 8, Fig. 7 b, d):
/// Hooke springs of every colour, integrated by backward Euler.
///
/// It takes the place of the projection: from the unconstrained positions x~ (eq. 9) it finds
///
///     y = argmin P(y),  P = sum_i (y_i - x~_i).(m_i + h D_i) (y_i - x~_i) / (2 h^2)
///                         + sum_s k (d_s(y) - l_s)^2 / 2 + c (d_s(y) - d_s(x))^2 / (2 h),
///
/// where x are the positions at the beginning of the step, d the length of a spring and c its dashpot, and D resists
/// velocities, 0 without air, so that a sheet at rest bears all of its weight and of the wind's push; the velocities
/// follow from the displacement (eq. 13). Newton's method starts from x~, and the step is halved until P falls, so that
/// the springs cannot gain energy from a large step. The tangent of a spring is K [n n^T + max(0, 1 - L/d) (I - n n^T)]
/// with direction n, K = k + c/h and L = (k l + c d(x)/h) / K; its negative part under compression is left out. Dead
/// springs do nothing, and removed particles stay where they are.
///
/// One matrix of 3x3 blocks whose pattern is made once; a rank assembles the rows of its own particles only. KSP prefix
/// `spring_`: conjugate gradients with 3x3 block Jacobi by default; `-spring_mat_type aij` for preconditioners that
/// need it (gamg, hypre).
class SpringBaseline {
 public:
  /// Collective. The sheet must outlive this object.
  SpringBaseline(const Sheet& sheet, const SpringOptions& options);

  /// Collective.
  /// @param positions in: unconstrained positions x~ [m], pinned particles in their place; out: positions at the end of
  /// the step. Ghosts up to date before and after.
  /// @returns the linear iterations of all Newton steps, and as error the largest component of the last update [m]
  StageResult advance(Field& positions, const SpringInput& input);

  /// Forces of the owned springs and their dashpots by colour at the end of the last step, positive where they pull
  /// [N]. Not collective.
  std::array<std::vector<double>, 4> forces(const Field& positions, const Living& living) const;
  /// Energy of the springs. Collective. [J] @param target_length, living as in SpringInput
  double elastic_energy(const Field& positions, const std::array<std::vector<double>, 4>& target_length,
                        const Living& living) const;
  /// Work of the dashpots in the last step, at most 0. Collective. [J]
  double viscous_work(const Field& positions, const Field& start, const Living& living) const;

 private:
  template <class Term>
  double sum_over_springs(const Living& living, const Term& term) const;
  void combine(const SpringInput& input);
  double potential(const Field& positions, const SpringInput& input) const;
  void assemble(const Field& positions, const SpringInput& input);

  const Sheet* sheet_;
  SpringOptions options_;
  double mean_length_ = 0;  ///< of the living springs [m]
  Field unconstrained_;     ///< x~
  Field before_update_;
  double dashpot_ = 0;                                  ///< c/h [N/m]
  double combined_stiffness_ = 0;                       ///< K [N/m]
  std::array<std::vector<double>, 4> combined_length_;  ///< L of the local springs of each colour [m]
  MatHandle tangent_;
  VecHandle residual_;
  VecHandle update_;
  KspHandle solver_;
};

}  // namespace projection
}  // namespace pellicle
