#pragma once

#include <array>
#include <vector>

#include "energies/step_part.h"

namespace pellicle::energies {

/// A StepPart whose energy is a sum of potentials. At one position they are evaluated once.
class PartOfPotentials : public StepPart {
 public:
  PartOfPotentials(const PartOfPotentials&) = delete;  // Its potentials point to it.
  PartOfPotentials& operator=(const PartOfPotentials&) = delete;

  const Layout& vertices() const override { return vertices_; }
  const std::vector<std::array<PetscInt, 3>>& triangles() const override { return triangles_; }
  const std::vector<Potential*>& potentials() const override { return potentials_; }
  const Field& position() const override { return position_; }
  bool move_to(const Field& position, const Eigen::VectorXd& own) override;
  void forget() override { is_evaluated_ = false; }
  double value() override;
  const Eigen::Matrix3Xd& gradient() override;
  const std::vector<double>& squared_forces() const override { return squares_; }
  double tolerance() const override { return tolerance_; }
  double length_scale() const override { return length_scale_; }
  double force_scale() const override { return force_scale_; }

 protected:
  /// @param vertices, triangles of the part, which must outlive it @param tolerance StepPart::tolerance
  PartOfPotentials(const Layout& vertices, const std::vector<std::array<PetscInt, 3>>& triangles, double tolerance)
      : vertices_(vertices), triangles_(triangles), tolerance_(tolerance), position_(vertices, 3) {}

  PetscInt owned() const { return vertices_.owned; }
  MPI_Comm comm() const { return vertices_.comm; }

  const Layout& vertices_;
  const std::vector<std::array<PetscInt, 3>>& triangles_;
  double tolerance_;
  std::vector<Potential*> potentials_;
  Field position_;
  double length_scale_ = 0;  ///< [m]
  double force_scale_ = 0;   ///< [N]

 private:
  void evaluate();

  // At `position_`, of this rank.
  bool is_evaluated_ = false;
  double value_ = 0;               ///< fraction of the energy [J]
  Eigen::Matrix3Xd gradient_;      ///< by the owned vertices, in the directions in which they may move [N]
  Eigen::Matrix3Xd of_potential_;  ///< the gradient of one potential, kept so that a step allocates nothing [N]
  std::vector<double> squares_;    ///< square of the norm of each potential's gradient [N^2]
};

}  // namespace pellicle::energies
