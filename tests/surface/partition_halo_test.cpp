// That the benchmark of partitions counts what sheets on so many ranks have.

#include "tests/support/partition_halo.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

/// How many ghosts this rank has of each rank.
std::vector<int> ghosts_by_owner(const Layout& layout, int ranks) {
  std::vector<PetscInt> first(ranks);
  MPI_Allgather(&layout.first, 1, MPIU_INT, first.data(), 1, MPIU_INT, layout.comm);
  std::vector<int> count(first.size(), 0);
  for (const PetscInt ghost : layout.ghost_global) {
    ++count[static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), ghost) - first.begin()) - 1];
  }
  return count;
}

TEST(PartitionHalo, IsThatOfASheetOnAsManyRanks) {
  int ranks = 1;
  int rank = 0;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const SurfaceMesh mesh = grid_mesh(23, 17, 0.1);
  std::vector<PetscInt> corners;
  for (const std::vector<int>& face : mesh.faces) {
    corners.insert(corners.end(), face.begin(), face.end());
  }
  const std::vector<PartHalo> halos =
      halos_of_sheet(corners, partition_with_metis(graph_of_quads(corners), ranks), ranks);
  const PartHalo& halo = halos.at(static_cast<std::size_t>(rank));
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, mesh, {});

  EXPECT_EQ(halo.cells, sheet.elements.owned);
  EXPECT_EQ(halo.particles, sheet.particles.owned);
  EXPECT_EQ(halo.ghosts, sheet.particles.ghosts());
  const std::vector<int> constrained = ghosts_by_owner(sheet.particles, ranks);
  std::vector<int> sent(constrained.size());
  MPI_Alltoall(constrained.data(), 1, MPI_INT, sent.data(), 1, MPI_INT, PETSC_COMM_WORLD);
  const auto parts_in = [](const std::vector<int>& counts) {
    return std::count_if(counts.begin(), counts.end(), [](int count) { return count > 0; });
  };
  EXPECT_EQ(halo.neighbours, parts_in(constrained));
  EXPECT_EQ(halo.receivers, parts_in(sent));
  EXPECT_EQ(halo.sent, std::accumulate(sent.begin(), sent.end(), 0));
  EXPECT_EQ(halo.ghosts > 0, ranks > 1);
}

}  // namespace
}  // namespace pellicle
