#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/handle.h"
#include "base/stage_result.h"
#include "linear/ksp.h"
#include "parallel/field.h"
#include "surface/sheet.h"

namespace pellicle::projection {

/// J W J^T + shift of the springs of several colours together, matrix-free: W holds the inverse masses of the
/// particles. Unknowns are the owned springs, colour after colour.
class JointGram {
 public:
  /// The sheet must outlive this object. Collective.
  /// @param colours of the springs @param prefix of the options of its matrix and solver
  /// @param rtol default relative tolerance of the solver
  JointGram(const Sheet& sheet, std::vector<Colour> colours, const std::string& prefix, double rtol);
  JointGram(const JointGram&) = delete;
  JointGram& operator=(const JointGram&) = delete;

  /// Sets new values. A spring that is dead, without length or without a movable particle has no effect. Collective.
  /// @param gradient of the local springs by colour; must stay unchanged until the next update
  /// @param inverse_mass of the local particles; must stay unchanged until the next update
  /// @param shift relative to the largest diagonal entry of a spring between particles of `shift_inverse_mass`
  void update(const std::array<const Eigen::Matrix3Xd*, 4>& gradient, const std::vector<double>& inverse_mass,
              double shift, double shift_inverse_mass);

  /// Sets lambda to 0, so that a step depends on its start alone. Collective.
  void begin_step() { check(VecSet(lambda_, 0)); }

  /// Solves for lambda, starting from the last solution in the step. Collective.
  /// @param right_hand_side of the owned springs, colour after colour
  StageResult solve(const std::vector<double>& right_hand_side, const LinearNeed& need);

  /// Lambda of the owned springs of a colour.
  const double* lambda(Colour colour) const { return lambda_values_.data() + offset_[colour]; }
  /// J^T lambda of the local particles, complete on the owned ones. Collective.
  void apply_transpose(Eigen::Matrix3Xd& result);

 private:
  /// Calls `visit` with each unknown, both ends of its spring and the three numbers of its gradient.
  template <class Visit>
  void for_each_unknown(const Visit& visit) const {
    std::size_t row = 0;
    for (const Colour colour : colours_) {
      const SpringSet& springs = sheet_.of(colour);
      const double* gradient = gradient_[colour]->data();
      for (PetscInt s = 0; s < springs.owned(); ++s, ++row, gradient += 3) {
        visit(row, springs.ends[s][0], springs.ends[s][1], gradient);
      }
    }
  }
  void multiply(Vec in_vector, Vec out_vector);
  void copy_diagonal(Vec out) const;
  void add_transpose(const double* lambda);

  const Sheet& sheet_;
  std::vector<Colour> colours_;
  std::array<std::size_t, 4> offset_{};  ///< first unknown of each colour
  std::array<const Eigen::Matrix3Xd*, 4> gradient_{};
  const std::vector<double>* inverse_mass_ = nullptr;
  std::vector<double> diagonal_;
  std::vector<double> shift_;  ///< of each unknown
  Field sum_;                  ///< on the particles
  std::vector<double> lambda_values_;
  MatHandle matrix_;
  VecHandle lambda_;
  VecHandle right_hand_side_;
  KspHandle ksp_;
};

}  // namespace pellicle::projection
