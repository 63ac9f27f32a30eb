#pragma once

#include <array>
#include <vector>

#include "base/handle.h"
#include "base/stage_result.h"
#include "mesh/field.h"
#include "mesh/sheet.h"

namespace pellicle {

class OptionTable;

struct SpringOptions {
  double stiffness = 100;  ///< k of every spring [N/m]
  double damping = 0;      ///< c/k of the dashpot beside every spring [s]
  int newton_steps = 1;    ///< linear solves a time step
};

void describe(OptionTable& table, SpringOptions& options);

/// What one step of the mass-spring sheet starts from.
struct SpringStep {
  const Field& start;                             ///< positions at the beginning of the step [m], ghosts up to date
  const double* mass = nullptr;                   ///< of the local particles [kg], positive
  std::array<const double*, 4> target_length{};   ///< l of the local springs of each colour [m]
  double h = 0;                                   ///< [s]
};

/// The mass-spring sheet that successive fast projection is compared with (burning paper, section 8, Fig. 7 b, d): Hooke
/// springs of every colour, integrated by backward Euler.
///
/// It takes the place of the projection: from the unconstrained positions x~ (eq. 9) it finds
///
///     y = argmin  sum_i m_i |y_i - x~_i|^2 / (2 h^2) + sum_s k (d_s(y) - l_s)^2 / 2,
///
/// plus the dashpots, by Newton steps from x~; the velocities follow from the displacement (eq. 13). The tangent of a
/// spring is k [n n^T + max(0, 1 - l/d) (I - n n^T)]: without the negative part of a compressed spring every step is
/// solvable. n is the direction of the spring, d its length.
///
/// One 3x3-blocked matrix whose pattern is made once; a rank assembles the rows of its own particles alone. KSP prefix
/// `spring_`: conjugate gradients with 3x3 block Jacobi unless told otherwise.
class SpringBaseline {
 public:
  /// Collective. The sheet must outlive this object.
  /// @param pinned of each local particle: these do not move
  SpringBaseline(const Sheet& sheet, std::vector<bool> pinned, const SpringOptions& options);

  /// Collective.
  /// @param positions in: unconstrained positions x~ [m], pinned particles in their place; out: positions at the end of
  /// the step. Ghosts up to date before and after.
  /// @returns the linear iterations, and as error the largest component of the last Newton update [m]
  StageResult advance(Field& positions, const SpringStep& step);

 private:
  void assemble(const Field& positions, const Field& unconstrained, const SpringStep& step);

  const Sheet* sheet_;
  std::vector<bool> pinned_;
  SpringOptions options_;
  Field unconstrained_;
  MatHandle tangent_;
  VecHandle residual_;
  VecHandle update_;
  KspHandle solver_;
};

}  // namespace pellicle
