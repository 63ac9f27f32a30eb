#include "projection/line_elimination.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "base/error.h"
#include "linear/ksp.h"
#include "meshing/generators.h"
#include "tests/projection/sheets.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

SurfaceMesh lined_mesh(const std::string& name) {
  return name == "grid"    ? grid_mesh(7, 5, 0.2)
         : name == "wide"  ? grid_mesh(80, 60, 0.2)  // so that lines are joined where ranks cut them
         : name == "torus" ? torus_mesh({12, 8}, 1, 0.3)
                           : tripod_mesh(2);
}

Sheet sheet_of(const std::string& name) {
  SheetOptions options;
  options.thickness = 0.05;
  return make_sheet(PETSC_COMM_WORLD, lined_mesh(name), options);
}

class LinesOf : public ::testing::TestWithParam<std::tuple<std::string, Colour>> {
 protected:
  LinesOf() : sheet_(sheet_of(std::get<0>(GetParam()))), springs_(sheet_.of(std::get<1>(GetParam()))) {}

  Sheet sheet_;
  const SpringSet& springs_;
};

INSTANTIATE_TEST_SUITE_P(all, LinesOf,
                         ::testing::Combine(::testing::Values("grid", "wide", "torus", "tripod"),
                                            ::testing::ValuesIn(all_colours)),
                         [](const auto& info) {
                           return std::get<0>(info.param) + "_" +
                                  colour_names[static_cast<std::size_t>(std::get<1>(info.param))];
                         });

TEST_P(LinesOf, HoldEveryOwnedSpringOnceAndChainByChain) {
  const SpringLines lines = find_lines(springs_, sheet_.particles);
  std::vector<int> count(springs_.owned(), 0);
  for (const auto* family : {&lines.eliminated.lines, &lines.kept.lines}) {
    for (const auto& line : *family) {
      ASSERT_FALSE(line.empty());
      for (std::size_t k = 0; k < line.size(); ++k) {
        ++count[line[k]];
        if (k > 0) {
          const auto [a, b] = springs_.ends[line[k]];
          const auto [c, d] = springs_.ends[line[k - 1]];
          EXPECT_EQ((a == c) + (a == d) + (b == c) + (b == d), 1);
        }
      }
    }
  }
  EXPECT_EQ(std::count(count.begin(), count.end(), 1), springs_.owned());
}

TEST_P(LinesOf, EliminatedSpringsMeetAlongTheirLinesOnly) {
  const LineFamily eliminated = find_lines(springs_, sheet_.particles).eliminated;
  // Number of its line and place in it of each local spring, with a gap between lines and ranks.
  Field place(springs_.layout, 1);
  place.values().setConstant(-1);
  double next = 10.0 * springs_.layout.first;
  for (const auto& line : eliminated.lines) {
    next += 2;
    for (const PetscInt spring : line) {
      place.data()[spring] = next++;
    }
  }
  place.update_ghosts();
  std::set<std::pair<PetscInt, PetscInt>> joined;
  for (const auto& [own, other] : eliminated.neighbours) {
    joined.insert({own, other});
  }
  for (const LineEnd& end : eliminated.ends) {
    joined.insert({end.pair.own, end.pair.other});
  }
  const std::set<PetscInt> separators(eliminated.separators.begin(), eliminated.separators.end());
  const Incidence incidence(springs_.ends, sheet_.particles.local());
  for (PetscInt s = 0; s < springs_.owned(); ++s) {
    if (separators.count(s) == 1) {
      continue;  // What is beside it says so.
    }
    for (const PetscInt particle : springs_.ends[s]) {
      for (const PetscInt other : incidence[particle]) {
        if (other != s && place.data()[s] >= 0 && place.data()[other] >= 0 && joined.count({s, other}) == 0) {
          EXPECT_EQ(std::abs(place.data()[s] - place.data()[other]), 1) << "springs " << s << ", " << other;
        }
      }
    }
  }
}

TEST_P(LinesOf, EliminationSolvesTheSameSystemAsTheAssembledRows) {
  SheetOptions noise;
  noise.perturbation = 0.1;
  const Eigen::Matrix3Xd x = perturbed_positions(sheet_, noise);
  Linearisation constraint;
  linearise(springs_, x.data(), springs_.initial_length, all_of(springs_), constraint);
  std::vector<double> inverse_mass;
  for (const PetscInt id : sheet_.persistent_id) {
    inverse_mass.push_back(id % 7 == 0 ? 0 : 1 + 0.1 * static_cast<double>(id % 5));
  }
  for (const double shift : {0.1, 1e-3}) {
    Gram gram(springs_, sheet_.particles, "aij");
    gram.update(constraint.gradient, inverse_mass, shift);
    VecHandle lambda;
    VecHandle right_hand_side;
    VecHandle product;
    check(MatCreateVecs(gram.operator_matrix(), lambda.create(), right_hand_side.create()));
    check(VecDuplicate(lambda, product.create()));
    for (PetscInt s = springs_.layout.first; s < springs_.layout.first + springs_.owned(); ++s) {
      check(VecSetValue(right_hand_side, s, std::sin(s), INSERT_VALUES));
    }
    check(VecAssemblyBegin(right_hand_side));
    check(VecAssemblyEnd(right_hand_side));

    LineElimination lines(springs_, sheet_.particles);
    lines.update(gram.diagonal(), constraint.gradient, inverse_mass);
    KspHandle ksp = make_ksp(lines.schur_complement(), lines.schur_complement(), "lines_test_",
                             {KSPCG, LineElimination::type, 1e-12});
    const StageResult result = lines.solve(ksp, right_hand_side, lambda);
    EXPECT_TRUE(result.converged) << result.reason;
    check(MatMult(gram.operator_matrix(), lambda, product));
    check(VecAXPY(product, -1, right_hand_side));
    double error = 0;
    double scale = 0;
    check(VecNorm(product, NORM_2, &error));
    check(VecNorm(right_hand_side, NORM_2, &scale));
    EXPECT_LE(error, 1e-9 * scale);

    // The same lines precondition the rows themselves, with which conjugate gradients do what they do with S.
    const KspHandle whole = make_ksp(gram.operator_matrix(), gram.preconditioning_matrix(), "whole_test_",
                                     {KSPCG, LineElimination::type, 1e-12});
    const LinearResult same = solve(whole, right_hand_side, product);
    EXPECT_TRUE(same.converged) << same.reason;
    EXPECT_NEAR(same.iterations, result.iterations, 2 + 0.1 * result.iterations);
    check(VecAXPY(product, -1, lambda));
    check(VecNorm(product, NORM_2, &error));
    check(VecNorm(lambda, NORM_2, &scale));
    EXPECT_LE(error, 1e-7 * scale);
  }
}

/// Iterations for S of a sheet that is not flat, to 1e-10.
PetscInt iterations_on(MPI_Comm comm, const SurfaceMesh& mesh, Colour colour) {
  SheetOptions options;
  options.thickness = 0.05;
  options.perturbation = 0.1;
  const Sheet sheet = make_sheet(comm, mesh, options);
  const SpringSet& springs = sheet.of(colour);
  Linearisation constraint;
  linearise(springs, perturbed_positions(sheet, options).data(), springs.initial_length, all_of(springs), constraint);
  const std::vector<double> inverse_mass(sheet.particles.local(), 1);
  Gram gram(springs, sheet.particles, "aij");
  gram.update(constraint.gradient, inverse_mass, 1e-2);
  LineElimination lines(springs, sheet.particles);
  lines.update(gram.diagonal(), constraint.gradient, inverse_mass);
  const KspHandle ksp = make_ksp(lines.schur_complement(), lines.schur_complement(), "lines_test_",
                                 {KSPCG, LineElimination::type, 1e-10});
  VecHandle lambda;
  VecHandle right_hand_side;
  check(MatCreateVecs(gram.operator_matrix(), lambda.create(), right_hand_side.create()));
  check(VecSet(right_hand_side, 1));
  return lines.solve(ksp, right_hand_side, lambda).iterations;
}

TEST(Lines, ThatRanksCutAreJoinedSoThatIterationsHardlyGrow) {
  const SurfaceMesh mesh = lined_mesh("wide");
  for (const Colour colour : all_colours) {
    const double alone = iterations_on(PETSC_COMM_SELF, mesh, colour);
    EXPECT_LE(iterations_on(PETSC_COMM_WORLD, mesh, colour), 1.5 * alone) << "against " << alone;
  }
}

/// Springs of all ranks in the smaller family of lines.
long smaller_family_on(MPI_Comm comm, const SurfaceMesh& mesh, Colour colour) {
  const Sheet sheet = make_sheet(comm, mesh, {});
  const SpringLines lines = find_lines(sheet.of(colour), sheet.particles);
  std::array<long, 2> counts{};
  for (const auto& line : lines.eliminated.lines) {
    counts[0] += static_cast<long>(line.size());
  }
  for (const auto& line : lines.kept.lines) {
    counts[1] += static_cast<long>(line.size());
  }
  MPI_Allreduce(MPI_IN_PLACE, counts.data(), 2, MPI_LONG, MPI_SUM, comm);
  return std::min(counts[0], counts[1]);
}

TEST(Lines, OfAGridGoOnWhereverRanksCutThem) {
  const SurfaceMesh mesh = lined_mesh("wide");
  for (const Colour colour : all_colours) {
    EXPECT_EQ(smaller_family_on(PETSC_COMM_WORLD, mesh, colour), smaller_family_on(PETSC_COMM_SELF, mesh, colour));
  }
}

TEST(Lines, OfAGridOnOneRankCrossItFromSideToSide) {
  SheetOptions options;
  const SurfaceMesh mesh = grid_mesh(7, 5, 0.2);
  const Sheet sheet = make_sheet(PETSC_COMM_SELF, mesh, options);
  const auto lengths = [&](Colour colour) {
    const SpringLines lines = find_lines(sheet.of(colour), sheet.particles);
    std::array<std::map<std::size_t, int>, 2> count;
    for (const auto& line : lines.eliminated.lines) {
      ++count[0][line.size()];
    }
    for (const auto& line : lines.kept.lines) {
      ++count[1][line.size()];
    }
    if (count[1] < count[0]) {
      std::swap(count[0], count[1]);
    }
    return count;
  };
  using Count = std::map<std::size_t, int>;
  // 6 lines of 7 edges along x, 8 lines of 5 along y; lattice points are a grid of 7 x 5.
  EXPECT_EQ(lengths(Colour::blue), (std::array<Count, 2>{Count{{5, 8}}, Count{{7, 6}}}));
  EXPECT_EQ(lengths(Colour::green), (std::array<Count, 2>{Count{{4, 7}}, Count{{6, 5}}}));
  // Diagonals, two springs a cell: i + j = const holds 1 to 5 cells.
  const Count diagonals{{2, 2}, {4, 2}, {6, 2}, {8, 2}, {10, 3}};
  EXPECT_EQ(lengths(Colour::red), (std::array<Count, 2>{diagonals, diagonals}));
}

TEST(Lines, WithoutAShiftAStraightLineBetweenPinsDoesNotBreakTheSolve) {
  Eigen::Matrix3Xd rest(3, 4);
  rest << 0, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0;
  Scene scene(hand_made_sheet(rest, {{Colour::blue, {{0, 1}, {1, 2}, {2, 3}}}}));
  scene.pinned[0] = scene.pinned[3] = true;
  scene.x.values()(0, 1) = 1.3;
  ProjectOptions options;
  options.shift = 0;
  SuccessiveProjection projection(scene.sheet, options);
  const StageResult result = projection.advance(scene.x, scene.input());
  EXPECT_TRUE(result.converged) << result.reason;
  EXPECT_NEAR(scene.x.values()(0, 1), 1, 1e-3);
  EXPECT_NEAR(scene.x.values()(0, 2), 2, 1e-3);
}

}  // namespace
}  // namespace pellicle
