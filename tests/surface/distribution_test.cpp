#include "surface/distribution.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "meshing/generators.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

/// A mesh of quads as every rank knows it, with ids that are not the numbers in it, and the rank of each cell.
struct WholeMesh {
  SurfaceMesh mesh;
  std::vector<int> part;  ///< of each cell

  std::size_t cells() const { return mesh.faces.size(); }
  static PetscInt cell_id(std::size_t cell) { return 3 * static_cast<PetscInt>(cell) + 1; }
  static PetscInt vertex_id(std::size_t vertex) { return 2 * static_cast<PetscInt>(vertex) + 5; }
  std::array<PetscInt, 4> corner_ids(std::size_t cell) const {
    std::array<PetscInt, 4> ids{};
    std::transform(mesh.faces[cell].begin(), mesh.faces[cell].end(), ids.begin(), vertex_id);
    return ids;
  }

  /// As rows that lie anywhere, with data that tell the ids. All ranks but the first have some.
  MeshRows rows() const {
    int ranks = 1;
    int rank = 0;
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    const auto is_here = [&](PetscInt id) { return (ranks == 1 ? 0 : 1 + id % (ranks - 1)) == rank; };
    MeshRows rows;
    rows.corners = 4;
    rows.has_uv = true;
    rows.groups = {"even", "some"};
    rows.group_sets = {{}, {1}, {0, 1}, {0}};
    rows.fields = {"thickness", "density"};
    std::vector<PetscInt> cell_data;
    std::vector<PetscInt> lattice_data;
    std::vector<PetscInt> vertex_data;
    for (std::size_t cell = cells(); cell-- > 0;) {
      const PetscInt id = cell_id(cell);
      if (is_here(id)) {
        rows.cells.push_back(point_of(id));
        const auto corners = corner_ids(cell);
        rows.cell_corners.insert(rows.cell_corners.end(), corners.begin(), corners.end());
        const auto value = static_cast<double>(id);
        rows.field_values.insert(rows.field_values.end(), {value + 0.25, value + 0.5});
        cell_data.insert(cell_data.end(), {id, -id});
        lattice_data.push_back(-id);
        if (!part.empty()) {
          rows.part.push_back(part[cell]);
        }
      }
    }
    for (std::size_t vertex = mesh.points.size(); vertex-- > 0;) {
      const PetscInt id = vertex_id(vertex);
      if (is_here(id)) {
        rows.vertices.push_back(point_of(id));
        vertex_data.push_back(id);
      }
    }
    rows.cell_data = Records::of(cell_data, static_cast<PetscInt>(rows.cells.size()), 2);
    rows.lattice_data = Records::of(lattice_data);
    rows.vertex_data = Records::of(vertex_data);
    return rows;
  }

  /// The data of a cell or a vertex, by its id alone.
  static MeshRows::Point point_of(PetscInt id) {
    const auto value = static_cast<double>(id);
    return {{std::sin(value), std::cos(value), 0.1 * value}, {0.5 * value, -value}, 0.01 * value, id, id % 4};
  }
};

/// Three pieces: a rectangle, a torus, and a square that has one corner in common with the rectangle. The first and the
/// last vertex have no cells. Each rank has cells here and there, but of three and more ranks the second one none.
WholeMesh three_pieces() {
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  WholeMesh whole;
  whole.mesh.points.emplace_back(0, 0, 9);
  int first = 1;
  for (const SurfaceMesh& piece : {grid_mesh(12, 3, 0.1), torus_mesh({8, 4}, 1, 0.3), grid_mesh(1, 1, 0.1)}) {
    whole.mesh.points.insert(whole.mesh.points.end(), piece.points.begin(), piece.points.end());
    for (std::vector<int> face : piece.faces) {
      for (int& corner : face) {
        corner += first;
      }
      whole.mesh.faces.push_back(face);
    }
    first = static_cast<int>(whole.mesh.points.size());
  }
  whole.mesh.faces.back()[2] = 1;
  std::vector<int> with_cells(static_cast<std::size_t>(ranks > 2 ? ranks - 1 : ranks));
  for (std::size_t r = 0; r < with_cells.size(); ++r) {
    with_cells[r] = static_cast<int>(r > 0 && ranks > 2 ? r + 1 : r);
  }
  for (std::size_t cell = 0; cell < whole.cells(); ++cell) {
    whole.part.push_back(with_cells[cell / 7 % with_cells.size()]);
  }
  return whole;
}

class DistributionTest : public ::testing::TestWithParam<int> {
 protected:
  DistributionTest() {
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank_);
    for (std::size_t cell = 0; cell < whole_.cells(); ++cell) {
      for (const PetscInt vertex : whole_.corner_ids(cell)) {
        cells_at_[vertex].push_back(cell);
        const auto [last, is_first] = owner_.emplace(vertex, whole_.part[cell]);
        last->second = std::max(last->second, whole_.part[cell]);
      }
    }
    for (std::size_t cell = 0; cell < whole_.cells(); ++cell) {
      if (whole_.part[cell] == rank_) {
        constrained_.insert(cell);
      }
    }
    for (int layer = 0; layer < GetParam(); ++layer) {
      const std::set<std::size_t> before = constrained_;
      for (const std::size_t cell : before) {
        for (const PetscInt vertex : whole_.corner_ids(cell)) {
          constrained_.insert(cells_at_[vertex].begin(), cells_at_[vertex].end());
        }
      }
    }
  }

  Distribution distribution() const {
    return Distribution(PETSC_COMM_WORLD, whole_.rows(), GetParam(), Numbering::by_id_unless_scattered, {});
  }
  static std::size_t cell_of(PetscInt id) { return static_cast<std::size_t>(id / 3); }
  static std::vector<PetscInt> ids(const Distribution& mesh, PetscInt begin, PetscInt end) {
    std::vector<PetscInt> result;
    for (PetscInt point = begin; point < end; ++point) {
      result.push_back(mesh.data(point).id);
    }
    return result;
  }
  /// That global numbers say which items are the same on all ranks.
  static void expect_the_same_items(const Layout& layout, const std::vector<PetscInt>& ids) {
    ASSERT_EQ(ids.size(), layout.local());
    const std::vector<PetscInt> all =
        of_all_ranks(PETSC_COMM_WORLD, std::vector<PetscInt>(ids.begin(), ids.begin() + layout.owned));
    ASSERT_EQ(layout.global, all.size());
    for (PetscInt i = 0; i < layout.local(); ++i) {
      EXPECT_EQ(all[layout.to_global(i)], ids[i]);
    }
    EXPECT_TRUE(std::is_sorted(layout.ghost_global.begin(), layout.ghost_global.end()));
  }

  int rank_ = 0;
  WholeMesh whole_ = three_pieces();
  std::map<PetscInt, std::vector<std::size_t>> cells_at_;  ///< each vertex
  std::map<PetscInt, int> owner_;                          ///< of each vertex
  std::set<std::size_t> constrained_;                      ///< cells of this rank, and the layers round them
};

INSTANTIATE_TEST_SUITE_P(, DistributionTest, ::testing::Values(0, 1, 2),
                         [](const auto& info) { return "layers_" + std::to_string(info.param); });

TEST_P(DistributionTest, HoldsItsCellsAndTheLayersRoundThem) {
  const Distribution mesh = distribution();
  const std::vector<PetscInt> cells = ids(mesh, 0, mesh.cells());
  expect_the_same_items(mesh.cell_layout, cells);
  const auto ghost = cells.begin() + mesh.cell_layout.owned;
  EXPECT_TRUE(std::is_sorted(cells.begin(), ghost));
  for (PetscInt cell = 0; cell < mesh.cells(); ++cell) {
    EXPECT_EQ(mesh.is_owned(cell), whole_.part[cell_of(cells[cell])] == rank_);
  }
  std::set<PetscInt> expected_cells;
  std::set<PetscInt> expected_vertices;
  for (const std::size_t cell : constrained_) {
    expected_cells.insert(WholeMesh::cell_id(cell));
    for (const PetscInt vertex : whole_.corner_ids(cell)) {
      expected_vertices.insert(vertex);
    }
  }
  EXPECT_EQ(std::set<PetscInt>(cells.begin(), cells.end()), expected_cells);
  EXPECT_EQ(cells.size(), expected_cells.size());
  const std::vector<PetscInt> vertices = ids(mesh, mesh.cells(), mesh.points());
  EXPECT_EQ(std::set<PetscInt>(vertices.begin(), vertices.end()), expected_vertices);
  EXPECT_EQ(vertices.size(), expected_vertices.size());
  for (PetscInt vertex = mesh.cells(); vertex < mesh.points(); ++vertex) {
    EXPECT_EQ(mesh.is_owned(vertex), owner_.at(mesh.data(vertex).id) == rank_);
  }
}

TEST_P(DistributionTest, KnowsCornersAndOppositeSides) {
  const Distribution mesh = distribution();
  std::map<std::set<PetscInt>, std::vector<PetscInt>> sides;
  for (PetscInt cell = 0; cell < mesh.cells(); ++cell) {
    const auto expected = whole_.corner_ids(cell_of(mesh.data(cell).id));
    const std::array<PetscInt, 4> corners = mesh.corners<4>(cell);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(mesh.data(corners[k]).id, expected[k]);
      sides[{expected[k], expected[(k + 1) % 4]}].push_back(4 * cell + static_cast<PetscInt>(k));
    }
  }
  ASSERT_EQ(mesh.opposite.size(), 4 * mesh.cells());
  for (const auto& [ends, both] : sides) {
    ASSERT_LE(both.size(), 2U);
    EXPECT_EQ(mesh.opposite[both.front()], both.size() == 2 ? both.back() : -1);
    EXPECT_EQ(mesh.opposite[both.back()], both.size() == 2 ? both.front() : -1);
  }
}

TEST_P(DistributionTest, HasTheDataOfAllThatItHolds) {
  const Distribution mesh = distribution();
  EXPECT_EQ(mesh.rows.fields, (std::vector<std::string>{"thickness", "density"}));
  std::vector<PetscInt> points;
  for (PetscInt point = mesh.points(); point-- > 0;) {
    points.push_back(point);
    const MeshRows::Point& data = mesh.data(point);
    const MeshRows::Point expected = WholeMesh::point_of(data.id);
    EXPECT_EQ(data.position, expected.position);
    EXPECT_EQ(data.uv, expected.uv);
    EXPECT_EQ(data.mass, expected.mass);
    EXPECT_EQ(mesh.groups_of(point), whole_.rows().group_sets[expected.group_set]);
  }
  for (PetscInt cell = 0; cell < mesh.cells(); ++cell) {
    const PetscInt id = mesh.data(cell).id;
    EXPECT_EQ(mesh.rows.field_values[2 * cell + 0], static_cast<double>(id) + 0.25);
    EXPECT_EQ(mesh.rows.field_values[2 * cell + 1], static_cast<double>(id) + 0.5);
    EXPECT_EQ(mesh.rows.cell_data.of_items({cell}).as<PetscInt>(), (std::vector<PetscInt>{id, -id}));
  }
  const std::vector<PetscInt> data = mesh.particle_data(points).as<PetscInt>();
  ASSERT_EQ(data.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PetscInt id = mesh.data(points[i]).id;
    EXPECT_EQ(data[i], points[i] < mesh.cells() ? -id : id);
  }
}

TEST_P(DistributionTest, GivesChangedDataToTheGhosts) {
  Distribution mesh = distribution();
  for (PetscInt point = 0; point < mesh.points(); ++point) {
    mesh.data(point).mass = mesh.is_owned(point) ? 7.0 * static_cast<double>(mesh.data(point).id) : -1;
  }
  update_ghosts(mesh.cell_layout, mesh.rows.cells);
  update_ghosts(mesh.vertex_layout, mesh.rows.vertices);
  for (PetscInt point = 0; point < mesh.points(); ++point) {
    EXPECT_EQ(mesh.data(point).mass, 7.0 * static_cast<double>(mesh.data(point).id));
  }
}

TEST_P(DistributionTest, NumbersItsPiecesOverAllRanks) {
  const Distribution mesh = distribution();
  std::vector<bool> is_closed;
  const std::vector<int> piece = mesh.find_pieces(is_closed);
  ASSERT_EQ(piece.size(), mesh.cells());
  const std::size_t in_rectangle = 12 * 3;
  const std::size_t in_torus = 8 * 4;
  if (GetParam() > 0) {  // Without ghosts ranks do not know where pieces go on.
    EXPECT_EQ(is_closed, (std::vector<bool>{false, true, false}));
    for (PetscInt cell = 0; cell < mesh.cells(); ++cell) {
      const std::size_t number = cell_of(mesh.data(cell).id);
      EXPECT_EQ(piece[cell], number < in_rectangle ? 0 : number < in_rectangle + in_torus ? 1 : 2);
    }
  }
}

TEST_P(DistributionTest, MakesParticlesOfSomeCellsAndVertices) {
  const Distribution mesh = distribution();
  std::vector<PetscInt> points;
  for (const bool owned : {true, false}) {
    for (PetscInt point = 0; point < mesh.points(); ++point) {
      if (mesh.is_owned(point) == owned && mesh.data(point).id % 5 < 3) {
        points.push_back(point);
      }
    }
  }
  Surface surface;
  mesh.fill(surface, points);
  ASSERT_EQ(surface.particles.local(), points.size());
  // The ghosts lie behind the owned ones as the owners have them, of each kind.
  std::vector<PetscInt> keys;  // to be the same on all ranks: vertices and cells may have the same ids
  std::set<PetscInt> some;
  std::set<PetscInt> even;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const MeshRows::Point& data = mesh.data(points[i]);
    keys.push_back(2 * data.id + (points[i] < mesh.cells() ? 1 : 0));
    EXPECT_EQ(surface.persistent_id[i], data.id);
    EXPECT_EQ(surface.rest.col(static_cast<Eigen::Index>(i)), Eigen::Vector3d(data.position.data()));
    EXPECT_EQ(surface.uv.col(static_cast<Eigen::Index>(i)), Eigen::Vector2d(data.uv.data()));
    if (data.id % 4 == 1 || data.id % 4 == 2) {
      some.insert(static_cast<PetscInt>(i));
    }
    if (data.id % 4 > 1) {
      even.insert(static_cast<PetscInt>(i));
    }
  }
  std::vector<PetscInt> known = keys;
  std::fill(known.begin() + surface.particles.owned, known.end(), -1);
  update_ghosts(surface.particles, known);
  EXPECT_EQ(known, keys);
  ASSERT_EQ(surface.groups.size(), 2U);
  EXPECT_EQ(surface.groups["some"], std::vector<PetscInt>(some.begin(), some.end()));
  EXPECT_EQ(surface.groups["even"], std::vector<PetscInt>(even.begin(), even.end()));
}

TEST_P(DistributionTest, TellsTheQualityOfThePartition) {
  if (GetParam() == 0) {
    return;  // Ranks do not know the cells beyond.
  }
  Surface surface;
  distribution().fill(surface, {});
  std::map<std::set<PetscInt>, std::set<int>> ranks_at;  // each side
  std::map<int, double> count;
  for (std::size_t cell = 0; cell < whole_.cells(); ++cell) {
    const auto corners = whole_.corner_ids(cell);
    for (std::size_t k = 0; k < 4; ++k) {
      ranks_at[{corners[k], corners[(k + 1) % 4]}].insert(whole_.part[cell]);
    }
    ++count[whole_.part[cell]];
  }
  EXPECT_EQ(surface.partition.edge_cut,
            std::count_if(ranks_at.begin(), ranks_at.end(), [](const auto& side) { return side.second.size() == 2; }));
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  double largest = 0;
  for (const auto& [part, cells] : count) {
    largest = std::max(largest, cells);
  }
  EXPECT_DOUBLE_EQ(surface.partition.imbalance, largest * ranks / static_cast<double>(whole_.cells()));
}

/// Mean of how far apart the vertices of an owned cell are numbered.
double spread_of(const Distribution& mesh) {
  double sum = 0;
  for (PetscInt cell = 0; cell < mesh.cell_layout.owned; ++cell) {
    const std::array<PetscInt, 4> corners = mesh.corners<4>(cell);
    const auto [least, greatest] = std::minmax_element(corners.begin(), corners.end());
    sum += static_cast<double>(*greatest - *least) / mesh.cell_layout.owned;
  }
  return sum;
}

TEST(DistributionNumbering, IsByIdUnlessThatIsScattered) {
  constexpr int side = 30;
  WholeMesh rows;
  rows.mesh = grid_mesh(side, side, 0.1);
  WholeMesh scattered = rows;  // with vertices in an order that leads all over the grid
  const auto points = static_cast<int>(rows.mesh.points.size());
  for (std::vector<int>& face : scattered.mesh.faces) {
    for (int& corner : face) {
      corner = corner * 398 % points;  // points is 31^2
    }
  }
  const Distribution by_id(PETSC_COMM_WORLD, rows.rows(), 1, Numbering::by_id_unless_scattered, {});
  std::vector<PetscInt> ids;
  for (PetscInt vertex = by_id.cells(); vertex < by_id.points() && by_id.is_owned(vertex); ++vertex) {
    ids.push_back(by_id.data(vertex).id);
  }
  EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
  for (const WholeMesh* mesh : {&rows, &scattered}) {
    for (const Numbering numbering : {Numbering::by_nearness, Numbering::by_id_unless_scattered}) {
      const Distribution distribution(PETSC_COMM_WORLD, mesh->rows(), 1, numbering, {});
      EXPECT_LT(spread_of(distribution), 3 * side);
    }
  }
}

TEST(DistributionParts, AreRunsOfIdsForTheSimplePartitioner) {
  WholeMesh whole = three_pieces();
  whole.part.clear();
  SheetOptions options;
  options.partitioner = "simple";
  const Distribution mesh(PETSC_COMM_WORLD, whole.rows(), 1, Numbering::by_nearness, options);
  int ranks = 1;
  int rank = 0;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const auto cells = static_cast<PetscInt>(whole.cells());
  std::set<PetscInt> expected;
  const PetscInt first = rank * (cells / ranks) + std::min<PetscInt>(rank, cells % ranks);
  for (PetscInt cell = first; cell < first + cells / ranks + (rank < cells % ranks ? 1 : 0); ++cell) {
    expected.insert(WholeMesh::cell_id(static_cast<std::size_t>(cell)));
  }
  std::set<PetscInt> own;
  for (PetscInt cell = 0; cell < mesh.cell_layout.owned; ++cell) {
    own.insert(mesh.data(cell).id);
  }
  EXPECT_EQ(own, expected);
}

TEST(DistributionParts, ShareTheLoadsOfTheCellsToo) {
  WholeMesh whole;
  whole.mesh = grid_mesh(40, 20, 0.1);
  MeshRows rows = whole.rows();
  const auto load_of = [](PetscInt id) { return id % (3 * 40) < 3 * 10 ? 20.0 : 1.0; };  // much in a quarter
  for (const MeshRows::Point& cell : rows.cells) {
    rows.load.push_back(load_of(cell.id));
  }
  const Distribution mesh(PETSC_COMM_WORLD, std::move(rows), 1, Numbering::by_nearness, {});
  double load = 0;
  for (PetscInt cell = 0; cell < mesh.cell_layout.owned; ++cell) {
    load += load_of(mesh.data(cell).id);
  }
  EXPECT_LT(shares_of_ranks(PETSC_COMM_WORLD, load).imbalance, 1.15);
  EXPECT_LT(shares_of_ranks(PETSC_COMM_WORLD, static_cast<double>(mesh.cell_layout.owned)).imbalance, 1.15);
}

}  // namespace
}  // namespace pellicle
