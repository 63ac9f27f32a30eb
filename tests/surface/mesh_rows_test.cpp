#include "surface/mesh_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "base/error.h"
#include "meshing/generators.h"
#include "meshing/triangulation.h"
#include "parallel/route.h"
#include "surface/membrane.h"
#include "surface/shell.h"
#include "tests/support/balls.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

/// Where rows lie before a mesh is built from them, and in what order.
struct Placement {
  const char* name;
  std::function<int(PetscInt id, int ranks)> rank_of;
};

const std::vector<Placement> placements{
    {"all on the first rank", [](PetscInt, int) { return 0; }},
    {"all on the last rank", [](PetscInt, int ranks) { return ranks - 1; }},
    {"in turn", [](PetscInt id, int ranks) { return static_cast<int>(id) % ranks; }},
    {"none on the first rank",
     [](PetscInt id, int ranks) { return ranks == 1 ? 0 : 1 + static_cast<int>(id * 7) % (ranks - 1); }}};

template <class Value>
void rearrange(std::vector<Value>& values, const std::vector<PetscInt>& order, std::size_t each = 1) {
  const auto count = static_cast<PetscInt>(order.size());
  values = Records::of(values, count, each).of_items(order).template as<Value>();
}

/// The same rows in other places.
MeshRows shuffled(MPI_Comm comm, MeshRows rows, const Placement& placement) {
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  std::mt19937 random(7);
  const auto place = [&](const std::vector<MeshRows::Point>& points) {
    std::vector<int> rank;
    for (const MeshRows::Point& point : points) {
      rank.push_back(placement.rank_of(point.id, ranks));
    }
    return rank;
  };
  const auto order_of = [&random](PetscInt count) {
    std::vector<PetscInt> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), random);
    return order;
  };
  const auto count = static_cast<PetscInt>(rows.cells.size());
  const auto corners = static_cast<std::size_t>(rows.corners);
  const Route cells(comm, place(rows.cells));
  const std::vector<PetscInt> cell_order = order_of(static_cast<PetscInt>(cells.sources().size()));
  rows.cells = cells.send(rows.cells);
  rows.part = cells.send(rows.part);
  rows.cell_corners = cells.send(Records::of(rows.cell_corners, count, corners)).as<PetscInt>();
  rows.field_values = cells.send(Records::of(rows.field_values, count, rows.fields.size())).as<double>();
  rows.cell_data = cells.send(rows.cell_data).of_items(cell_order);
  rows.lattice_data = cells.send(rows.lattice_data).of_items(cell_order);
  rearrange(rows.cells, cell_order);
  rearrange(rows.part, cell_order);
  rearrange(rows.cell_corners, cell_order, corners);
  rearrange(rows.field_values, cell_order, rows.fields.size());
  const Route vertices(comm, place(rows.vertices));
  const std::vector<PetscInt> vertex_order = order_of(static_cast<PetscInt>(vertices.sources().size()));
  rows.vertices = vertices.send(rows.vertices);
  rows.vertex_data = vertices.send(rows.vertex_data).of_items(vertex_order);
  rearrange(rows.vertices, vertex_order);
  return rows;
}

void expect_equal(const Layout& one, const Layout& other) {
  EXPECT_EQ(one.owned, other.owned);
  EXPECT_EQ(one.first, other.first);
  EXPECT_EQ(one.global, other.global);
  EXPECT_EQ(one.ghost_global, other.ghost_global);
}

void expect_equal(const Surface& one, const Surface& other) {
  expect_equal(one.particles, other.particles);
  EXPECT_EQ(one.persistent_id, other.persistent_id);
  EXPECT_EQ(one.is_lattice, other.is_lattice);
  EXPECT_EQ(one.cell_count, other.cell_count);
  EXPECT_EQ(one.rest, other.rest);
  EXPECT_EQ(one.uv, other.uv);
  EXPECT_EQ(one.groups, other.groups);
  EXPECT_EQ(one.partition.edge_cut, other.partition.edge_cut);
  EXPECT_EQ(one.partition.imbalance, other.partition.imbalance);
}

void expect_equal(const Sheet& one, const Sheet& other) {
  expect_equal(static_cast<const Surface&>(one), static_cast<const Surface&>(other));
  EXPECT_EQ(one.owned_corners, other.owned_corners);
  EXPECT_EQ(one.particles.global - one.elements.global, other.particles.global - other.elements.global);
  EXPECT_EQ(one.elements.global, other.elements.global);
  EXPECT_EQ(one.first_lattice_id, other.first_lattice_id);
  EXPECT_EQ(one.id_end, other.id_end);
  EXPECT_EQ(one.initial_mass, other.initial_mass);
  EXPECT_EQ(one.cells, other.cells);
  EXPECT_EQ(one.lattice, other.lattice);
  EXPECT_EQ(one.elements.owned, other.elements.owned);
  for (const Colour colour : all_colours) {
    expect_equal(one.of(colour).layout, other.of(colour).layout);
    EXPECT_EQ(one.of(colour).ends, other.of(colour).ends);
    EXPECT_EQ(one.of(colour).initial_length, other.of(colour).initial_length);
    EXPECT_EQ(one.of(colour).triangles, other.of(colour).triangles);
  }
}

/// A number for each particle or cell.
Records numbers(PetscInt count, const std::function<PetscInt(PetscInt)>& number) {
  std::vector<PetscInt> values;
  for (PetscInt i = 0; i < count; ++i) {
    values.push_back(number(i));
  }
  return Records::of(values);
}

/// The ids of the owned particles, and of the owned cells.
Records particle_ids(const Surface& points) {
  return numbers(points.particles.owned, [&](PetscInt i) { return points.persistent_id[i]; });
}
Records cell_ids(const Sheet& sheet) {
  return numbers(sheet.elements.owned, [&](PetscInt cell) { return -sheet.persistent_id[sheet.lattice[cell]]; });
}

/// Builds the sheet from its rows in other places.
void expect_same_from_any_place(const Sheet& sheet, const SheetOptions& options) {
  const std::vector<bool> all(sheet.elements.owned, true);
  for (const Placement& placement : placements) {
    SCOPED_TRACE(placement.name);
    MeshRows rows = shuffled(sheet.comm(), rows_of(sheet, all, particle_ids(sheet), cell_ids(sheet)), placement);
    const LoadedSheet loaded =
        make_sheet(sheet.comm(), std::move(rows), {sheet.first_lattice_id, sheet.id_end}, options);
    expect_equal(loaded.sheet, sheet);
    EXPECT_EQ(loaded.particles.as<PetscInt>(), sheet.persistent_id);
    std::vector<PetscInt> expected_cells;
    for (const PetscInt lattice : sheet.lattice) {
      expected_cells.push_back(-sheet.persistent_id[lattice]);
    }
    EXPECT_EQ(loaded.cells.as<PetscInt>(), expected_cells);
  }
}

SurfaceMesh grouped_grid() {
  SurfaceMesh mesh = grid_mesh(11, 8, 0.1);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    mesh.points[i].z() = 0.02 * std::sin(9 * mesh.points[i].x()) * std::cos(4 * mesh.points[i].y());
    if (mesh.points[i].x() < 0.25) {
      mesh.groups["left"].push_back(static_cast<int>(i));
    }
    if (mesh.points[i].y() < 0.35) {
      mesh.groups["low"].push_back(static_cast<int>(i));
    }
  }
  mesh.groups["none"];
  return mesh;
}

TEST(MeshRowsTest, ASheetDoesNotDependOnWhereItsRowsLay) {
  const SheetOptions options;
  expect_same_from_any_place(make_sheet(PETSC_COMM_WORLD, grouped_grid(), options), options);
}

TEST(MeshRowsTest, NorDoesOneThatHasBeenCompacted) {
  SheetOptions options;
  Sheet sheet = make_sheet(PETSC_COMM_WORLD, grouped_grid(), options);
  // Stays where it is, is spread anew, and stays again, where one of several ranks becomes empty.
  const std::array<std::pair<double, double>, 3> rounds{{{100, 0.25}, {1, 0.4}, {100, 0.95}}};
  for (const auto& [limit, from] : rounds) {
    std::vector<bool> kept;
    for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
      kept.push_back(sheet.rest(0, sheet.lattice[cell]) > from);
    }
    options.imbalance_limit = limit;
    LoadedSheet left = compact(sheet, kept, particle_ids(sheet), cell_ids(sheet), options);
    EXPECT_EQ(left.particles.as<PetscInt>(), left.sheet.persistent_id);
    sheet = std::move(left.sheet);
    expect_same_from_any_place(sheet, options);
  }
}

TEST(MeshRowsTest, APartitionDoesNotDependOnWhereTheRowsLay) {
  for (const char* partitioner : {"metis", "simple"}) {  // PT-Scotch draws other random numbers each time.
    SheetOptions options;
    options.partitioner = partitioner;
    const Sheet sheet = make_sheet(PETSC_COMM_WORLD, grouped_grid(), options);
    const std::vector<bool> all(sheet.elements.owned, true);
    for (const Placement& placement : placements) {
      SCOPED_TRACE(std::string(partitioner) + ", " + placement.name);
      MeshRows rows = shuffled(PETSC_COMM_WORLD, rows_of(sheet, all, particle_ids(sheet), cell_ids(sheet)), placement);
      rows.part.clear();
      expect_equal(make_sheet(PETSC_COMM_WORLD, std::move(rows), {sheet.first_lattice_id, sheet.id_end}, options).sheet,
                   sheet);
    }
  }
}

TEST(MeshRowsTest, AMembraneDoesNotDependOnWhereItsRowsLay) {
  SurfaceMesh mesh = triangulated(joined(torus_mesh({12, 8}, 1, 0.4), rectangle_mesh({5, 4}, {2, 1}), {0, 0, 3}));
  mesh.groups.clear();
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    mesh.face_fields["thickness"].push_back(1e-3 * static_cast<double>(f));
    mesh.face_fields["density"].push_back(1000 + static_cast<double>(f));
  }
  for (int i = 0; i < 20; ++i) {
    mesh.groups["some"].push_back(3 * i);
    mesh.face_groups["some"].push_back(5 * i);
  }
  const SheetOptions options;
  const Membrane membrane = make_membrane(PETSC_COMM_WORLD, mesh, options);
  const auto element_ids = numbers(membrane.elements.owned, [&](PetscInt e) { return membrane.element_id[e]; });
  for (const Placement& placement : placements) {
    SCOPED_TRACE(placement.name);
    const LoadedMembrane loaded = make_membrane(
        PETSC_COMM_WORLD, shuffled(PETSC_COMM_WORLD, rows_of(membrane, particle_ids(membrane), element_ids), placement),
        options);
    expect_equal(static_cast<const Surface&>(loaded.membrane), static_cast<const Surface&>(membrane));
    expect_equal(loaded.membrane.elements, membrane.elements);
    EXPECT_EQ(loaded.membrane.triangles, membrane.triangles);
    EXPECT_EQ(loaded.membrane.element_id, membrane.element_id);
    EXPECT_EQ(loaded.membrane.element_uv, membrane.element_uv);
    EXPECT_EQ(loaded.membrane.element_fields, membrane.element_fields);
    EXPECT_EQ(loaded.membrane.element_groups, membrane.element_groups);
    EXPECT_EQ(loaded.membrane.piece, membrane.piece);
    EXPECT_EQ(loaded.membrane.piece_is_closed, membrane.piece_is_closed);
    EXPECT_EQ(loaded.particles.as<PetscInt>(), membrane.persistent_id);
    EXPECT_EQ(loaded.elements.as<PetscInt>(), membrane.element_id);
  }
}

TEST(MeshRowsTest, ACornerWithoutAVertexIsRefusedOnEveryRank) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MeshRows rows = rows_of(PETSC_COMM_WORLD, grouped_grid());
  if (rank == 0) {
    rows.vertices.erase(rows.vertices.begin() + 17);
    rows.vertex_data = Records(0, static_cast<PetscInt>(rows.vertices.size()));
  }
  try {
    make_sheet(PETSC_COMM_WORLD, std::move(rows), {1000, 2000}, {});
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("vertex 17 "), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace pellicle
