#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "energies/tangent.h"
#include "parallel/layout.h"

namespace pellicle {
namespace {

constexpr PetscInt owned = 24;
constexpr PetscInt local = 30;

struct Terms {
  std::vector<DifferenceTerm> differences;
  NumberRows numbers;

  explicit Terms(double along) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> number(-1, 1);
    for (PetscInt a = 0; a < owned; ++a) {
      for (PetscInt b = a + 1; b < local; b += 1 + a % 3) {
        differences.push_back({a, b, {number(random), number(random), number(random)}, number(random)});
      }
      for (PetscInt b = a + a % 2; b < local; b += 1 + a % 4) {  // Every other row has no diagonal.
        numbers.columns.push_back(b);
        numbers.entries.push_back(number(random));
      }
      numbers.offsets.push_back(static_cast<PetscInt>(numbers.columns.size()));
    }
    numbers.along = along;
    numbers.normals = Field(number_owned(PETSC_COMM_SELF, local), 3);
    for (PetscInt i = 0; i < local; ++i) {
      numbers.normals.vector(i) << number(random), number(random), number(random);
    }
  }

  void visit(HessianTerms& terms) const {
    terms.add_numbers(numbers);
    terms.add_differences(differences);
    terms.add_numbers(numbers);  // Nothing is left over from what came before.
  }
};

TEST(TermProductTest, MultipliesAsTheBlocksDo) {
  for (const double along : {0.0, 0.7}) {
    const Terms terms(along);
    Eigen::Matrix4Xd factor = Eigen::Matrix4Xd::Zero(4, local);
    factor.topRows<3>().setRandom();
    Eigen::Matrix3Xd wanted = Eigen::Matrix3Xd::Zero(3, owned);
    const auto take = [&](PetscInt row, PetscInt column, const Eigen::Matrix3d& block) {
      wanted.col(row) += block * factor.col(column).head<3>();
    };
    TakenBlocks blocks(owned, take);
    terms.visit(blocks);
    Eigen::Matrix4Xd product = Eigen::Matrix4Xd::Zero(4, local);
    TermProduct by_terms(owned, local, factor.data(), product.data());
    terms.visit(by_terms);
    EXPECT_GT(wanted.norm(), 1);
    EXPECT_LT((product.topLeftCorner(3, owned) - wanted).norm(), 1e-13 * wanted.norm()) << along;
  }
}

}  // namespace
}  // namespace pellicle
