#include <gtest/gtest.h>

#include "meshing/surface_mesh.h"
#include "surface/membrane.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

TEST(MembraneGeometry, AreasRoundVertices) {
  const int nx = 6;
  const int ny = 5;
  const double edge = 0.5;
  // Every cell cut from its first corner to the third.
  SurfaceMesh mesh = grid_mesh(nx, ny, edge);
  std::vector<std::vector<int>> triangles;
  for (const auto& face : mesh.faces) {
    triangles.push_back({face[0], face[1], face[2]});
    triangles.push_back({face[0], face[2], face[3]});
  }
  mesh.faces.assign(triangles.begin(), triangles.end());
  mesh.uv.clear();
  const Membrane membrane = make_membrane(PETSC_COMM_WORLD, mesh, SheetOptions());
  const std::vector<double> areas = vertex_areas(membrane);
  ASSERT_EQ(areas.size(), static_cast<std::size_t>(membrane.particles.local()));
  double total = 0;
  for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
    const PetscInt id = membrane.persistent_id[i];
    const PetscInt column = id % (nx + 1);
    const PetscInt row = id / (nx + 1);
    int count = 0;  // two of the cells that lie low left and up right of it, one of the others
    for (const auto& [dx, dy, triangles_of_cell] : {std::tuple{-1, -1, 2}, {0, 0, 2}, {-1, 0, 1}, {0, -1, 1}}) {
      const bool exists = column + dx >= 0 && column + dx < nx && row + dy >= 0 && row + dy < ny;
      count += exists ? triangles_of_cell : 0;
    }
    EXPECT_NEAR(areas[i], count * edge * edge / 6, 1e-14) << id;
    total += i < membrane.particles.owned ? areas[i] : 0;
  }
  MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_NEAR(total, nx * ny * edge * edge, 1e-13);
}

}  // namespace
}  // namespace pellicle
