#include "state/mesh_tables.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "surface/shell.h"
#include "tests/io/files.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

struct MeshTables : ::testing::Test {
  MeshTables() {
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    mesh = grid_mesh(9, 6, 0.1);
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
      mesh.points[i].z() = 0.01 * static_cast<double>(i % 7);
      mesh.point_id.push_back(static_cast<int>(2 * i + 1));
      mesh.groups[i % 3 == 0 ? "third of all" : "others"].push_back(static_cast<int>(i));
    }
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
      mesh.face_fields["thickness"].push_back(1.0 / static_cast<double>(f + 1));
    }
  }

  void write(MPI_Comm comm, const MeshRows& rows) const {
    Hdf5File file(comm, path, Hdf5File::Mode::create);
    write_mesh(file, "a/mesh", rows);
    file.close();
  }
  MeshRows read(MPI_Comm comm) const {
    const Hdf5File file(comm, path, Hdf5File::Mode::read);
    return read_mesh(file, "a/mesh");
  }

  static void expect_equal(const Sheet& one, const Sheet& other) {
    EXPECT_EQ(one.persistent_id, other.persistent_id);
    EXPECT_EQ(one.particles.ghost_global, other.particles.ghost_global);
    EXPECT_EQ(one.rest, other.rest);
    EXPECT_EQ(one.uv, other.uv);
    EXPECT_EQ(one.groups, other.groups);
    EXPECT_EQ(one.initial_mass, other.initial_mass);
    EXPECT_EQ(one.cells, other.cells);
    EXPECT_EQ(one.first_lattice_id, other.first_lattice_id);
    EXPECT_EQ(one.id_end, other.id_end);
  }

  int rank = 0;
  int ranks = 1;
  SurfaceMesh mesh;
  TestFolder folder;
  std::string path = folder / "mesh.h5";
};

TEST_F(MeshTables, AMeshKeepsItsPartition) {
  SheetOptions simple;
  simple.partitioner = "simple";  // which METIS would not find
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, mesh, simple);
  write(PETSC_COMM_WORLD, rows_of_mesh(sheet));
  const MeshRows rows = read(PETSC_COMM_WORLD);
  EXPECT_LE(rows.cells.size(), mesh.faces.size() / static_cast<std::size_t>(ranks) + 1) << "a share";
  expect_equal(make_sheet(PETSC_COMM_WORLD, rows, SheetOptions()), sheet);
}

TEST_F(MeshTables, OnOtherRanksAPartitionIsFound) {
  if (rank == 0) {
    write(PETSC_COMM_SELF, rows_of_mesh(make_sheet(PETSC_COMM_SELF, mesh, SheetOptions())));
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  const MeshRows rows = read(PETSC_COMM_WORLD);
  EXPECT_EQ(rows.part.empty(), ranks > 1);
  expect_equal(make_sheet(PETSC_COMM_WORLD, rows, SheetOptions()), make_sheet(PETSC_COMM_WORLD, mesh, SheetOptions()));
}

TEST_F(MeshTables, ASheetComesBackWithItsMassesAndPlaces) {
  SheetOptions options;
  options.thickness = 0.03;
  options.areal_density = 7;
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, mesh, options);
  const std::vector<bool> all(sheet.elements.owned, true);
  write(PETSC_COMM_WORLD, rows_of(sheet, all, {}, {}));
  expect_equal(
      make_sheet(PETSC_COMM_WORLD, read(PETSC_COMM_WORLD), {sheet.first_lattice_id, sheet.id_end}, options).sheet,
      sheet);
}

TEST_F(MeshTables, FieldsAndGroupsOfElementsComeBack) {
  const std::vector<double> expected = mesh.face_fields.at("thickness");
  mesh.face_groups["others"] = {1, 7, 23};
  MeshRows rows = rows_of(PETSC_COMM_WORLD, mesh);
  rows.part.assign(rows.cells.size(), 0);
  write(PETSC_COMM_WORLD, rows);
  const MeshRows read_back = read(PETSC_COMM_WORLD);
  EXPECT_EQ(read_back.fields, std::vector<std::string>{"thickness"});
  for (std::size_t i = 0; i < read_back.cells.size(); ++i) {
    const MeshRows::Point& cell = read_back.cells[i];
    EXPECT_EQ(read_back.field_values[i], expected[cell.id]);
    const bool is_in_group = cell.id == 1 || cell.id == 7 || cell.id == 23;
    EXPECT_EQ(read_back.group_sets[cell.group_set], is_in_group ? std::vector<int>{0} : std::vector<int>{});
  }
  EXPECT_EQ(read_back.groups, (std::vector<std::string>{"others", "third of all"}));
}

TEST_F(MeshTables, WhatDoesNotFitTogetherIsRefused) {
  MeshRows rows = rows_of(PETSC_COMM_WORLD, mesh);
  rows.part.assign(rows.cells.size(), 9);
  const auto fault = [this] {
    try {
      read(PETSC_COMM_WORLD);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  write(PETSC_COMM_WORLD, rows);
  EXPECT_EQ(fault(), path + ": table a/mesh/cells/rank: 9; expected 0 to " + std::to_string(ranks - 1));
  {
    Hdf5File file(PETSC_COMM_WORLD, path, Hdf5File::Mode::create);
    file.write_once<double>("a/mesh/vertices/weight", {1, 2});
    write_mesh(file, "a/mesh", rows);
    file.close();
  }
  EXPECT_EQ(fault(), path + ": table a/mesh/vertices/weight has 2 rows; expected those of a/mesh/vertices/id, 70");
}

}  // namespace
}  // namespace pellicle
