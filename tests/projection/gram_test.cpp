#include "projection/gram.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/projection/sheets.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

constexpr double shift = 0.01;

SurfaceMesh mesh_of(const std::string& name) { return name == "grid" ? grid_mesh(5, 4, 0.25) : tripod_mesh(2); }

/// A crumpled sheet whose particles have different inverse masses, some of them none.
struct Crumpled {
  explicit Crumpled(const std::string& mesh) {
    SheetOptions options;
    options.thickness = 0.1;
    options.perturbation = 0.1;
    sheet = make_sheet(PETSC_COMM_WORLD, mesh_of(mesh), options);
    x = perturbed_positions(sheet, options);
    for (const PetscInt id : sheet.persistent_id) {
      inverse_mass.push_back(id % 7 == 0 ? 0 : 1 + 0.1 * static_cast<double>(id % 5));
    }
  }

  Sheet sheet;
  Eigen::Matrix3Xd x;
  std::vector<double> inverse_mass;
};

Linearisation linearise(const Crumpled& crumpled, Colour colour) {
  Linearisation result;
  const SpringSet& springs = crumpled.sheet.of(colour);
  linearise(springs, crumpled.x.data(), springs.initial_length, all_of(springs), result);
  return result;
}

/// J W J^T + shift of all ranks, from its definition. Collective.
Eigen::MatrixXd dense_gram(const Crumpled& crumpled, Colour colour,
                           std::optional<double> shift_inverse_mass = std::nullopt) {
  const Layout& particles = crumpled.sheet.particles;
  const SpringSet& springs = crumpled.sheet.of(colour);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(springs.layout.global, 3 * particles.global);
  for (PetscInt s = 0; s < springs.owned(); ++s) {
    const auto [a, b] = springs.ends[s];
    // C = |x_a - x_b|^2/l - l
    const Eigen::RowVector3d gradient =
        2 / springs.initial_length[s] * (crumpled.x.col(a) - crumpled.x.col(b)).transpose();
    jacobian.block<1, 3>(springs.layout.first + s, 3 * particles.to_global(a)) = gradient;
    jacobian.block<1, 3>(springs.layout.first + s, 3 * particles.to_global(b)) = -gradient;
  }
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(3 * particles.global);
  for (PetscInt i = 0; i < particles.owned; ++i) {
    weight.segment<3>(3 * (particles.first + i)).setConstant(crumpled.inverse_mass[i]);
  }
  MPI_Allreduce(MPI_IN_PLACE, jacobian.data(), static_cast<int>(jacobian.size()), MPI_DOUBLE, MPI_SUM, particles.comm);
  MPI_Allreduce(MPI_IN_PLACE, weight.data(), static_cast<int>(weight.size()), MPI_DOUBLE, MPI_SUM, particles.comm);
  Eigen::MatrixXd gram = jacobian * weight.asDiagonal() * jacobian.transpose();
  const double largest = gram.diagonal().maxCoeff();
  // A row of the Jacobian has its gradient twice, once for each end.
  const double shifted_by =
      shift * (shift_inverse_mass ? *shift_inverse_mass * jacobian.rowwise().squaredNorm().maxCoeff() : largest);
  for (Eigen::Index s = 0; s < gram.rows(); ++s) {
    gram(s, s) += gram(s, s) > 0 ? shifted_by : largest;
  }
  return gram;
}

class GramMatrix : public ::testing::TestWithParam<std::tuple<std::string, Colour>> {};

INSTANTIATE_TEST_SUITE_P(all, GramMatrix,
                         ::testing::Combine(::testing::Values("grid", "tripod"), ::testing::ValuesIn(all_colours)),
                         [](const auto& info) {
                           return std::get<0>(info.param) + "_" +
                                  colour_names[static_cast<std::size_t>(std::get<1>(info.param))];
                         });

TEST_P(GramMatrix, RowsAreThoseOfTheDenseProduct) {
  Crumpled crumpled(std::get<0>(GetParam()));
  const Colour colour = std::get<1>(GetParam());
  Gram gram(crumpled.sheet.of(colour), crumpled.sheet.particles, "aij");
  for (const std::optional<double> shift_inverse_mass : {std::optional<double>(), std::optional(2.5)}) {
    crumpled.x.row(0) *= 1.5;  // The second update fills the same pattern anew.
    const Eigen::MatrixXd expected = dense_gram(crumpled, colour, shift_inverse_mass);
    const Linearisation constraint = linearise(crumpled, colour);
    gram.update(constraint.gradient, crumpled.inverse_mass, shift, shift_inverse_mass);
    std::vector<PetscInt> columns(expected.cols());
    for (std::size_t column = 0; column < columns.size(); ++column) {
      columns[column] = static_cast<PetscInt>(column);
    }
    Eigen::RowVectorXd row(expected.cols());
    PetscInt first = 0;
    PetscInt last = 0;
    check(MatGetOwnershipRange(gram.operator_matrix(), &first, &last));
    for (PetscInt r = first; r < last; ++r) {
      check(MatGetValues(gram.operator_matrix(), 1, &r, static_cast<PetscInt>(columns.size()), columns.data(),
                         row.data()));
      EXPECT_LE((row - expected.row(r)).cwiseAbs().maxCoeff(), 1e-13 * expected.cwiseAbs().maxCoeff()) << "row " << r;
    }
  }
}

TEST_P(GramMatrix, EveryTypeMultipliesLikeTheDenseProduct) {
  const Crumpled crumpled(std::get<0>(GetParam()));
  const Colour colour = std::get<1>(GetParam());
  const SpringSet& springs = crumpled.sheet.of(colour);
  const Eigen::MatrixXd expected = dense_gram(crumpled, colour);
  const Eigen::VectorXd in = Eigen::VectorXd::LinSpaced(expected.cols(), -1, 2).array().sin();
  const Eigen::VectorXd product = expected * in;
  const double scale = product.cwiseAbs().maxCoeff();
  const Linearisation constraint = linearise(crumpled, colour);
  for (const char* type : {"aij", "sell", "shell"}) {
    Gram gram(springs, crumpled.sheet.particles, type);
    gram.update(constraint.gradient, crumpled.inverse_mass, 0);
    gram.update(constraint.gradient, crumpled.inverse_mass, shift);
    VecHandle from;
    VecHandle to;
    check(MatCreateVecs(gram.preconditioning_matrix(), from.create(), to.create()));
    double* values = nullptr;
    check(VecGetArrayWrite(from, &values));
    Eigen::Map<Eigen::VectorXd>(values, springs.owned()) = in.segment(springs.layout.first, springs.owned());
    check(VecRestoreArrayWrite(from, &values));
    const double* result = nullptr;
    check(MatMult(gram.operator_matrix(), from, to));
    check(VecGetArrayRead(to, &result));
    for (PetscInt s = 0; s < springs.owned(); ++s) {
      EXPECT_NEAR(result[s], product[springs.layout.first + s], 1e-13 * scale) << type;
    }
    check(VecRestoreArrayRead(to, &result));
    check(MatGetDiagonal(gram.operator_matrix(), to));
    check(VecGetArrayRead(to, &result));
    for (PetscInt s = 0; s < springs.owned(); ++s) {
      EXPECT_NEAR(result[s], expected.diagonal()[springs.layout.first + s], 1e-13 * expected.diagonal().maxCoeff())
          << type;
    }
    check(VecRestoreArrayRead(to, &result));
  }
}

TEST(Gram, MeshesOfTheseTestsHaveValences3To6) {
  const SurfaceMesh mesh = tripod_mesh(2);
  std::vector<int> valence(mesh.points.size(), 0);
  for (const auto& face : mesh.faces) {
    for (const int vertex : face) {
      ++valence[vertex];
    }
  }
  for (const int faces : {3, 4, 5, 6}) {
    EXPECT_NE(std::count(valence.begin(), valence.end(), faces), 0) << faces;
  }
  // Closed, without a handle: V - E + F = 2 with E = 2 F.
  EXPECT_EQ(mesh.points.size(), mesh.faces.size() + 2);
}

TEST(Gram, RowWithoutLengthIsTheLargestEntryAlone) {
  Eigen::Matrix3Xd rest(3, 4);
  rest << 0, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0;
  const Sheet sheet = hand_made_sheet(rest, {{Colour::blue, {{0, 1}, {1, 2}, {2, 3}}}});
  const SpringSet& blue = sheet.of(Colour::blue);
  rest.col(2) = rest.col(1);
  Linearisation constraint;
  linearise(blue, rest.data(), blue.initial_length, all_of(blue), constraint);
  Gram gram(blue, sheet.particles, "aij");
  const std::vector<double> inverse_mass(4, 1);
  gram.update(constraint.gradient, inverse_mass, 0);
  // Lengths 1, 0, 2 of targets 1, 1, 1: diagonal 2 (2 d/l)^2.
  const Eigen::Vector3d diagonal(8, 32, 32);
  for (PetscInt row = 0; row < 3; ++row) {
    for (PetscInt column = 0; column < 3; ++column) {
      double value = 0;
      check(MatGetValues(gram.operator_matrix(), 1, &row, 1, &column, &value));
      EXPECT_DOUBLE_EQ(value, row == column ? diagonal[row] : 0) << row << " " << column;
    }
  }
}

TEST(Gram, TransposedJacobianGivesOppositeForcesAtBothEnds) {
  const Crumpled crumpled("grid");
  const Linearisation constraint = linearise(crumpled, Colour::red);
  const SpringSet& red = crumpled.sheet.of(Colour::red);
  Gram gram(red, crumpled.sheet.particles, "aij");
  VecHandle lambda;
  check(MatCreateVecs(gram.preconditioning_matrix(), lambda.create(), nullptr));
  check(VecSet(lambda, 1));
  Eigen::Matrix3Xd force;
  gram.apply_transpose(constraint.gradient, lambda, force);
  // With lambda = 1 the force on a lattice point is the sum of its cell's four gradients.
  for (PetscInt c = 0; c < crumpled.sheet.elements.owned; ++c) {
    const PetscInt lattice = crumpled.sheet.lattice[c];
    Eigen::Vector3d expected = Eigen::Vector3d::Zero();
    for (const PetscInt corner : crumpled.sheet.cells[c]) {
      const double length = (crumpled.sheet.rest.col(lattice) - crumpled.sheet.rest.col(corner)).norm();
      expected += 2 / length * (crumpled.x.col(lattice) - crumpled.x.col(corner));
    }
    EXPECT_LE((force.col(lattice) - expected).norm(), 1e-12 * (1 + expected.norm()));
  }
  Eigen::Vector3d sum = force.leftCols(crumpled.sheet.particles.owned).rowwise().sum();
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_LE(sum.norm(), 1e-12);
}

TEST(Gram, TwoSpringsBetweenTheSameParticlesAreAnError) {
  const Sheet sheet = hand_made_sheet(Eigen::Matrix3Xd::Random(3, 3), {{Colour::blue, {{0, 1}, {1, 2}, {1, 0}}}});
  EXPECT_THROW(Gram(sheet.of(Colour::blue), sheet.particles, "aij"), Error);
}

}  // namespace
}  // namespace pellicle
