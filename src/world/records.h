#pragma once

#include <Eigen/Core>

namespace pellicle {
inline namespace world {

// Numbers in a state that only remarks at the end of a run need.

/// The largest strain of the weave of a sheet in any step so far.
struct StrainRecord {
  double strain = -1;                               ///< -1: there has been no step
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< [m]
  double time = 0;                                  ///< [s]

  StrainRecord() = default;
  /// @param numbers see `numbers`
  explicit StrainRecord(const Eigen::VectorXd& numbers)
      : strain(numbers[0]), place(numbers.segment<3>(1)), time(numbers[4]) {}
  Eigen::Matrix<double, 5, 1> numbers() const {
    return (Eigen::Matrix<double, 5, 1>() << strain, place, time).finished();
  }
};

/// How the steps of a wall have ended so far.
struct StepRecord {
  double above_tolerance = 0;     ///< steps that ended out of balance
  double worst_step = 0;          ///< number of the worst of these
  double worst_residual = 0;      ///< its relative residual
  double last_residual = 0;       ///< relative residual of the last step
  double concave_steps = 0;       ///< steps in which a tangent was not positive definite
  double first_concave_step = 0;  ///< number of the first of these
  double factorised_steps = 0;    ///< steps in which the tangent was factorised

  StepRecord() = default;
  /// @param numbers see `numbers`
  explicit StepRecord(const Eigen::VectorXd& numbers)
      : above_tolerance(numbers[0]),
        worst_step(numbers[1]),
        worst_residual(numbers[2]),
        last_residual(numbers[3]),
        concave_steps(numbers[4]),
        first_concave_step(numbers[5]),
        factorised_steps(numbers[6]) {}
  Eigen::Matrix<double, 7, 1> numbers() const {
    return (Eigen::Matrix<double, 7, 1>() << above_tolerance, worst_step, worst_residual, last_residual, concave_steps,
            first_concave_step, factorised_steps)
        .finished();
  }
};

}  // namespace world
}  // namespace pellicle
