// A potential of one part of several limits a step of the whole.

#include <gtest/gtest.h>
#include <petscsys.h>

#include <algorithm>

#include "energies/step_objective.h"

namespace pellicle::part_potential_test {
namespace {

/// Lets no vertex move farther than 1 m.
class Fence : public Potential {
 public:
  explicit Fence(MPI_Comm comm) : comm_(comm) {}

  double value(const Field& /*x*/) const override { return 0; }
  void add_gradient(const Field& /*x*/, Eigen::Matrix3Xd& /*gradient*/) const override {}
  std::vector<VertexPair> pattern() const override { return {}; }
  void update_hessian(const Field& /*x*/, double /*psd_blend*/) override {}
  void add_hessian(const HessianBlocks& /*blocks*/) const override {}
  bool limits() const override { return true; }
  bool limit(const Field& /*x*/, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) override {
    double largest = step.cols() > 0 ? step.colwise().norm().maxCoeff() : 0;
    MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, comm_);
    for (Eigen::Index i = 0; i < step.cols(); ++i) {
      const double length = how == StepLimit::all_alike ? largest : step.col(i).norm();
      step.col(i) /= std::max(1.0, length);
    }
    return largest > 1;
  }

 private:
  MPI_Comm comm_;
};

TEST(PartPotential, LimitsThePartOrTheWholeStep) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const std::vector<Layout> parts{number_owned(PETSC_COMM_WORLD, 2), number_owned(PETSC_COMM_WORLD, rank == 0 ? 3 : 0)};
  const JoinedLayout joined(parts);
  Fence fence(PETSC_COMM_WORLD);
  PartPotential second(fence, joined, 1, parts[1]);
  const Field x(joined.layout(), 3);
  Eigen::Matrix3Xd step(3, joined.layout().owned);
  step.setConstant(4);
  if (rank == 0) {
    step.col(joined.first_owned(1) + 1) = Eigen::Vector3d(10, 0, 0);
    step.col(joined.first_owned(1) + 2) = Eigen::Vector3d(0, 0.5, 0);
  }
  Eigen::Matrix3Xd each = step;
  EXPECT_TRUE(second.limit(x, StepLimit::each_vertex, each));
  EXPECT_EQ(each.leftCols(2), step.leftCols(2)) << "the first part has no fence";
  if (rank == 0) {
    EXPECT_NEAR(each.col(joined.first_owned(1) + 1).norm(), 1, 1e-15);
    EXPECT_NEAR(each.col(joined.first_owned(1) + 2).norm(), 0.5, 1e-15);
  }
  Eigen::Matrix3Xd alike = step;
  EXPECT_TRUE(second.limit(x, StepLimit::all_alike, alike));
  EXPECT_LT((alike - step / 10).norm(), 1e-14) << "all of the step is a tenth";
  Eigen::Matrix3Xd small = step / 20;
  const Eigen::Matrix3Xd before = small;
  EXPECT_FALSE(second.limit(x, StepLimit::all_alike, small));
  EXPECT_EQ(small, before);
}

}  // namespace
}  // namespace pellicle::part_potential_test
