#pragma once

#include <array>
#include <vector>

#include "solvers/potential.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace elastic {

/// The springs of a sheet as Hooke's, U = sum_s k_s (|x_a - x_b| - L_s)^2 / 2. Nothing here
/// communicates.
///
/// The positive curvature leaves out what a compressed spring adds across its direction, where it is negative.
class SpringPotential : public Potential {
 public:
  /// The sheet must outlive it. Springs of other ranks that end at no particle of this one are left out.
  explicit SpringPotential(const Sheet& sheet);

  /// @param stiffness of the local springs by colour, 0 where one has died [N/m]
  /// @param length without force, likewise [m]
  void set(const std::array<std::vector<double>, 4>& stiffness, const std::array<std::vector<double>, 4>& length);

  /// Of the owned springs by colour, positive where they pull [N].
  std::array<std::vector<double>, 4> forces(const Field& x) const;

  double value(const Field& x) const override;
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  void update_hessian(const Field& x, Curvature curvature) override;
  void add_hessian(const HessianBlocks& blocks) const override;
  bool multiplies() const override { return true; }
  void add_product(const double* w, double* result) const override;

 private:
  struct Spring {
    PetscInt a;
    PetscInt b;
    double stiffness;
    double length;
  };
  /// Of a spring: along n n^T + across I.
  struct Curved {
    Eigen::Vector3d direction;  ///< square root of `along` times n
    double across;
  };

  const Sheet* sheet_;
  std::array<std::vector<std::size_t>, 4> number_;  ///< in its colour's set, of each spring, in order
  std::vector<std::size_t> owned_;                  ///< springs of this rank
  std::vector<Spring> springs_;
  std::vector<Curved> hessian_;
};

}  // namespace elastic
}  // namespace pellicle
