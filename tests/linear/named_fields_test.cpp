#include "linear/named_fields.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "linear/ksp.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

/// Names and rows of the fields that a DM knows.
std::vector<std::pair<std::string, std::vector<PetscInt>>> fields_of(DM dm) {
  PetscInt count = 0;
  char** names = nullptr;
  IS* rows = nullptr;
  std::vector<std::pair<std::string, std::vector<PetscInt>>> fields;
  check(DMCreateFieldDecomposition(dm, &count, &names, &rows, nullptr));
  for (PetscInt field = 0; field < count; ++field) {
    PetscInt size = 0;
    const PetscInt* indices = nullptr;
    check(ISGetLocalSize(rows[field], &size));
    check(ISGetIndices(rows[field], &indices));
    fields.emplace_back(names[field], std::vector<PetscInt>(indices, indices + size));
    check(ISRestoreIndices(rows[field], &indices));
    check(ISDestroy(&rows[field]));
    check(PetscFree(names[field]));
  }
  check(PetscFree(names));
  check(PetscFree(rows));
  return fields;
}

TEST(NamedFields, RowsGoRoundTheComponentsAndEndWithTheBorder) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const PetscInt border = rank == 0 ? 2 : 0;
  MatHandle matrix;
  check(MatCreateAIJ(PETSC_COMM_WORLD, 6 + border, 6 + border, PETSC_DETERMINE, PETSC_DETERMINE, 0, nullptr, 0, nullptr,
                     matrix.create()));
  const DmHandle dm = make_dm(matrix, "fields_", {{"x", "y", "z"}, "pressure", border});
  const PetscInt first = rank == 0 ? 0 : 8 + 6 * (rank - 1);
  const auto fields = fields_of(dm);
  ASSERT_EQ(fields.size(), 4U);
  EXPECT_EQ(fields[0], std::pair(std::string("x"), std::vector<PetscInt>{first, first + 3}));
  EXPECT_EQ(fields[1], std::pair(std::string("y"), std::vector<PetscInt>{first + 1, first + 4}));
  EXPECT_EQ(fields[2], std::pair(std::string("z"), std::vector<PetscInt>{first + 2, first + 5}));
  EXPECT_EQ(fields[3].first, "pressure");
  EXPECT_EQ(fields[3].second, rank == 0 ? (std::vector<PetscInt>{6, 7}) : std::vector<PetscInt>{});
}

TEST(NamedFields, FieldsplitTakesOptionsByTheirNames) {
  SolverOptions options;
  options.set("split_pc_type", "fieldsplit");
  options.set("split_fieldsplit_left_pc_type", "jacobi");
  options.set("split_fieldsplit_right_ksp_type", "cg");
  MatHandle pairs;
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  const PetscInt owned = 48 / ranks;  // even on up to 4 ranks
  check(MatCreate(PETSC_COMM_WORLD, pairs.create()));
  check(MatSetSizes(pairs, owned, owned, PETSC_DETERMINE, PETSC_DETERMINE));
  check(MatSetBlockSize(pairs, 2));
  check(MatSetType(pairs, MATAIJ));
  check(MatSetUp(pairs));
  PetscInt first = 0;
  PetscInt end = 0;
  check(MatGetOwnershipRange(pairs, &first, &end));
  for (PetscInt i = first; i < end; ++i) {
    check(MatSetValue(pairs, i, i, 3, INSERT_VALUES));
    check(MatSetValue(pairs, i, i ^ 1, 1, INSERT_VALUES));
  }
  check(MatAssemblyBegin(pairs, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(pairs, MAT_FINAL_ASSEMBLY));
  KspDefaults defaults{KSPCG, PCBJACOBI, 1e-10};
  defaults.fields = {"left", "right"};
  const KspHandle ksp = make_ksp(pairs, pairs, "split_", defaults);
  VecHandle x;
  VecHandle b;
  check(MatCreateVecs(pairs, x.create(), b.create()));
  check(VecSet(b, 4));
  const LinearResult result = solve(ksp, b, x);
  EXPECT_TRUE(result.converged) << result.reason;
  double largest = 0;
  check(VecShift(x, -1));
  check(VecNorm(x, NORM_INFINITY, &largest));
  EXPECT_LT(largest, 1e-9);
  PetscInt left = 0;
  check(PetscOptionsLeftGet(nullptr, &left, nullptr, nullptr));
  EXPECT_EQ(left, 0) << "every option was used";
}

}  // namespace
}  // namespace pellicle
