// The factor of a tangent with dense columns: inverse and inertia against dense ones.

#include "energies/tangent_factor.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "geometry/principal_axes.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

constexpr PetscInt vertices = 11;

/// Vertices joined to a ring, whose Hessian is the same everywhere: blocks beside the diagonal, and a shift on it.
class Ring : public Potential {
 public:
  explicit Ring(const Layout& layout) : layout_(layout) {}

  double shift = 0;

  Eigen::Matrix3d block(PetscInt row, PetscInt column) const {
    Eigen::Matrix3d on_diagonal;
    on_diagonal << 4, 1, 0, 1, 5, -1, 0, -1, 6;
    Eigen::Matrix3d beside;  // from a vertex to the next
    beside << -1, 0.5, 0, 0.2, -2, 0, 0, 0.3, -1.5;
    if (row == column) {
      return on_diagonal + (shift + 0.1 * static_cast<double>(row)) * Eigen::Matrix3d::Identity();
    }
    return column == (row + 1) % vertices ? beside : Eigen::Matrix3d(beside.transpose());
  }
  Eigen::MatrixXd dense() const {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(3 * vertices, 3 * vertices);
    for (PetscInt i = 0; i < vertices; ++i) {
      for (const PetscInt j : {i, (i + 1) % vertices, (i + vertices - 1) % vertices}) {
        matrix.block<3, 3>(3 * i, 3 * j) = block(i, j);
      }
    }
    return matrix;
  }

  double value(const Field&) const override { return 0; }
  void add_gradient(const Field&, Eigen::Matrix3Xd&) const override {}
  std::vector<VertexPair> pattern() const override {
    std::vector<VertexPair> pairs;
    for (PetscInt i = 0; i < layout_.owned; ++i) {
      const PetscInt global = layout_.first + i;
      for (const PetscInt step : {0, 1, static_cast<int>(vertices) - 1}) {
        pairs.push_back({i, (global + step) % vertices});
      }
    }
    return pairs;
  }
  void update_hessian(const Field&, double) override {}
  void add_hessian(const HessianBlocks& blocks) const override {
    const std::vector<VertexPair> pairs = pattern();
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      blocks.add(k, block(layout_.first + pairs[k].row, pairs[k].column));
    }
  }

 private:
  const Layout& layout_;
};

/// The ring on all ranks, with two columns, factorised.
struct FactorisedRing {
  explicit FactorisedRing(const std::string& type)
      : layout(number_owned(PETSC_COMM_WORLD, fraction())),
        ring(layout),
        position(layout, 3),
        tangent(layout, {&ring}, Projectors(static_cast<std::size_t>(layout.owned)), type, "ring_"),
        system(tangent.matrix(), 2, "ring_", {KSPCG, PCNONE, 1e-12}),
        factor(tangent, system, "ring_"),
        columns(3 * vertices, 2) {
    for (Eigen::Index i = 0; i < columns.rows(); ++i) {
      columns.row(i) << std::cos(0.3 * static_cast<double>(i)), 0.1 * static_cast<double>(i) - 1;
    }
  }

  static PetscInt fraction() {
    int rank = 0;
    int ranks = 1;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    return vertices * (rank + 1) / ranks - vertices * rank / ranks;
  }

  /// @returns what the factor says of the inertia
  std::optional<int> set(double shift, const Eigen::Vector2d& coefficients) {
    ring.shift = shift;
    tangent.update(position, Curvature::exact);
    system.update({columns.middleRows(3 * layout.first, 3 * layout.owned).sparseView(), coefficients});
    dense = ring.dense() + columns * coefficients.asDiagonal() * columns.transpose();
    return factor.refresh();
  }

  /// Largest difference of a solution from the dense one, over the largest of this one.
  double error_of_solution(int& iterations) {
    VecHandle x;
    VecHandle b;
    check(MatCreateVecs(tangent.matrix(), x.create(), b.create()));
    Eigen::VectorXd values(3 * vertices);
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      values[i] = std::sin(1.0 + static_cast<double>(i * i));
    }
    double* own = nullptr;
    check(VecGetArray(b, &own));
    std::copy_n(values.data() + 3 * layout.first, 3 * layout.owned, own);
    check(VecRestoreArray(b, &own));
    system.use(factor.solver());
    const LinearResult result = system.solve(b, x);
    EXPECT_TRUE(result.converged) << result.reason;
    iterations = result.iterations;
    const Eigen::VectorXd expected = dense.partialPivLu().solve(values);
    const double* found = nullptr;
    check(VecGetArrayRead(x, &found));
    double error = layout.owned > 0 ? (Eigen::Map<const Eigen::VectorXd>(found, 3 * layout.owned) -
                                       expected.segment(3 * layout.first, 3 * layout.owned))
                                          .cwiseAbs()
                                          .maxCoeff()
                                    : 0;
    check(VecRestoreArrayRead(x, &found));
    MPI_Allreduce(MPI_IN_PLACE, &error, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
    return error / expected.cwiseAbs().maxCoeff();
  }

  Layout layout;
  Ring ring;
  Field position;
  Tangent tangent;
  LowRankSystem system;
  TangentFactor factor;
  Eigen::MatrixXd columns;
  Eigen::MatrixXd dense;
};

int negative_eigenvalues(const Eigen::MatrixXd& matrix) {
  return static_cast<int>((principal_axes(matrix).values.array() < 0).count());
}

class TangentFactors : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Types, TangentFactors, ::testing::Values("baij", "aij", "sbaij"));

TEST_P(TangentFactors, KnowTheInertiaOfTheWhole) {
  FactorisedRing given(GetParam());
  std::vector<int> seen;
  for (const double shift : {2.0, -1.0, -2.5, -6.0}) {
    for (const Eigen::Vector2d& coefficients :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.5, 2), Eigen::Vector2d(-3, 0.7), Eigen::Vector2d(0, 50)}) {
      const std::optional<int> negative = given.set(shift, coefficients);
      ASSERT_TRUE(negative);
      EXPECT_EQ(*negative, negative_eigenvalues(given.dense)) << shift << ", " << coefficients.transpose();
      seen.push_back(*negative);
    }
  }
  EXPECT_EQ(*std::min_element(seen.begin(), seen.end()), 0);
  EXPECT_GT(*std::max_element(seen.begin(), seen.end()), 10);
}

TEST_P(TangentFactors, InvertTheWholeAlsoWhereTheSparsePartIsNotPositiveDefinite) {
  FactorisedRing given(GetParam());
  int iterations = 0;
  for (const auto& [shift, coefficients] :
       {std::pair{2.0, Eigen::Vector2d(0.5, 2)}, {2.0, Eigen::Vector2d(0, 0)}, {2.0, Eigen::Vector2d(-0.01, 3)}}) {
    given.set(shift, coefficients);
    EXPECT_LT(given.error_of_solution(iterations), 1e-10);
    EXPECT_LE(iterations, 2);
  }
  // The column is the direction along which the sparse part is negative.
  given.set(0, Eigen::Vector2d(0, 0));
  const PrincipalAxes modes = principal_axes(given.dense);
  given.columns.col(0) = modes.axes.col(0);
  const double shift = -(modes.values[0] + modes.values[1]) / 2;
  EXPECT_EQ(given.set(shift, Eigen::Vector2d(0, 0)), 1);
  EXPECT_EQ(given.set(shift, Eigen::Vector2d(20, 0)), 0);
  EXPECT_LT(given.error_of_solution(iterations), 1e-10);
  EXPECT_LE(iterations, 2);
}

// Of a column that is constrained: of the space that it leaves, whatever its coefficient.
TEST_P(TangentFactors, KnowAndInvertWhatHeldColumnsLeave) {
  FactorisedRing given(GetParam());
  given.system.hold({0});
  std::vector<int> seen;
  for (const double shift : {2.0, -1.0, -2.5, -6.0}) {
    for (const Eigen::Vector2d& coefficients : {Eigen::Vector2d(0, 0), Eigen::Vector2d(5, 2), Eigen::Vector2d(0, -3)}) {
      const std::optional<int> negative = given.set(shift, coefficients);
      const Eigen::MatrixXd all = given.columns.col(0).householderQr().householderQ();
      const auto space = all.rightCols(all.cols() - 1);
      const Eigen::MatrixXd whole = given.dense;
      ASSERT_TRUE(negative);
      EXPECT_EQ(*negative, negative_eigenvalues(space.transpose() * whole * space)) << shift;
      seen.push_back(*negative);
      if (*negative == 0) {
        VecHandle x;
        VecHandle b;
        check(MatCreateVecs(given.tangent.matrix(), x.create(), b.create()));
        check(VecSet(b, 1));
        given.system.project(b);
        given.system.use(given.factor.solver());
        const LinearResult result = given.system.solve(b, x);
        EXPECT_TRUE(result.converged) << result.reason;
        EXPECT_LE(result.iterations, 2);
      }
    }
  }
  EXPECT_EQ(*std::min_element(seen.begin(), seen.end()), 0);
  EXPECT_GT(*std::max_element(seen.begin(), seen.end()), 10);
}

TEST_P(TangentFactors, AreMadeAsTheOptionsOfMumpsSay) {
  SolverOptions options;
  options.set("ring_mat_mumps_icntl_7", "2");
  FactorisedRing given(GetParam());
  given.set(2, Eigen::Vector2d(0, 0));
  PetscBool is_used = PETSC_FALSE;
  check(PetscOptionsUsed(nullptr, "ring_mat_mumps_icntl_7", &is_used));
  EXPECT_EQ(is_used, PETSC_TRUE);
  options.set("ring_mat_mumps_icntl_7", "4");
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  if (ranks == 1) {
    TangentFactor::check_options(PETSC_COMM_WORLD, "ring_");
    EXPECT_EQ(FactorisedRing(GetParam()).set(2, Eigen::Vector2d(0, 0)), 0);
  } else {
    EXPECT_THROW(TangentFactor::check_options(PETSC_COMM_WORLD, "ring_"), Error);
  }
}

}  // namespace
}  // namespace pellicle
