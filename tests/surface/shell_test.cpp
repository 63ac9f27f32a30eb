#include "surface/shell.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>

#include "parallel/field.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

class Shell : public ::testing::TestWithParam<std::string> {
 protected:
  Sheet make(const SurfaceMesh& mesh) {
    SheetOptions options;
    options.partitioner = GetParam();
    options.thickness = 0.05;
    options.areal_density = 2;
    return make_sheet(PETSC_COMM_WORLD, mesh, options);
  }

  template <class T>
  static T sum(T value) {
    double total = static_cast<double>(value);
    MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return static_cast<T>(total);
  }
};

INSTANTIATE_TEST_SUITE_P(Partitioners, Shell, ::testing::Values("metis", "ptscotch", "simple"));

TEST_P(Shell, CountsSpringsOfAGrid) {
  const int nx = 7;
  const int ny = 5;
  const Sheet sheet = make(grid_mesh(nx, ny, 0.25));
  EXPECT_EQ(sheet.elements.global, nx * ny);
  EXPECT_EQ(sheet.particles.global - sheet.elements.global, (nx + 1) * (ny + 1));
  EXPECT_EQ(sheet.particles.global, nx * ny + (nx + 1) * (ny + 1));
  EXPECT_EQ(sheet.of(Colour::red).layout.global, 4 * nx * ny);
  EXPECT_EQ(sheet.of(Colour::yellow).layout.global, 2 * nx * ny);
  EXPECT_EQ(sheet.of(Colour::blue).layout.global, nx * (ny + 1) + ny * (nx + 1));
  EXPECT_EQ(sheet.of(Colour::green).layout.global, (nx - 1) * ny + nx * (ny - 1));
  EXPECT_EQ(sum(sheet.elements.owned), nx * ny);
}

TEST_P(Shell, CountsTheCellsRoundEachCorner) {
  const double a = 0.25;
  const Sheet sheet = make(grid_mesh(7, 5, a));
  ASSERT_EQ(static_cast<PetscInt>(sheet.cell_count.size()), sheet.particles.owned);
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    const auto is_between = [a](double x, int cells) { return x > a / 2 && x < (cells - 0.5) * a; };
    const int expected = (is_between(sheet.rest(0, i), 7) ? 2 : 1) * (is_between(sheet.rest(1, i), 5) ? 2 : 1);
    const auto p = static_cast<std::size_t>(i);
    EXPECT_EQ(sheet.cell_count[p], sheet.is_lattice[p] ? 0 : expected);
  }
}

TEST_P(Shell, InitialLengthsAreThoseOfTheBodyCentredSquare) {
  const double a = 0.25;
  const Sheet sheet = make(grid_mesh(6, 6, a));
  const std::array<double, 4> expected{std::sqrt(a * a / 2 + 0.05 * 0.05), a, a, std::sqrt(2) * a};
  for (const Colour colour : all_colours) {
    for (const double length : sheet.of(colour).initial_length) {
      EXPECT_NEAR(length, expected[static_cast<std::size_t>(colour)], 1e-14);
    }
  }
}

TEST_P(Shell, MassesAddUpToDensityTimesArea) {
  const Sheet sheet = make(grid_mesh(6, 4, 0.25));
  const double mass =
      std::accumulate(sheet.initial_mass.begin(), sheet.initial_mass.begin() + sheet.particles.owned, 0.0);
  EXPECT_NEAR(sum(mass), 2 * 6 * 4 * 0.25 * 0.25, 1e-13);
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    if (sheet.is_lattice[i]) {
      EXPECT_NEAR(sheet.initial_mass[i], 0.0625, 1e-15);
      EXPECT_NEAR(sheet.rest(2, i), 0.05, 1e-15);
    }
  }
}

// Every rank must see all springs at its particles and at the ends of its springs, and a ghost must name the owner's
// spring.
TEST_P(Shell, GhostsCompleteTheSpringsRoundOwnedOnes) {
  const Sheet sheet = make(grid_mesh(9, 8, 0.1));
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet.of(colour);
    // The number of springs at a particle, as its rank sees it and as the owners of the springs count it.
    std::vector<int> seen(sheet.particles.local(), 0);
    Field counted(sheet.particles, 1);
    for (PetscInt s = 0; s < set.local(); ++s) {
      for (const PetscInt end : set.ends[s]) {
        ASSERT_GE(end, 0);
        ++seen[end];
        counted.values()(0, end) += s < set.owned() ? 1 : 0;
      }
    }
    counted.add_ghosts();
    counted.update_ghosts();
    for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
      EXPECT_EQ(seen[i], counted.values()(0, i)) << colour_names[static_cast<int>(colour)];
    }
    for (PetscInt s = 0; s < set.owned(); ++s) {
      for (const PetscInt end : set.ends[s]) {
        EXPECT_EQ(seen[end], counted.values()(0, end));
      }
    }

    // Owners write the persistent ids of both ends by global number; ghosts must find the same pair.
    Field ids(set.layout, 2);
    const auto pair = [&](PetscInt s) {
      const auto& [a, b] = set.ends[s];
      const auto id_a = sheet.persistent_id[a];
      const auto id_b = sheet.persistent_id[b];
      return Eigen::Vector2d(std::min(id_a, id_b), std::max(id_a, id_b));
    };
    for (PetscInt s = 0; s < set.owned(); ++s) {
      ids.values().col(s) = pair(s);
    }
    ids.update_ghosts();
    for (PetscInt s = 0; s < set.local(); ++s) {
      EXPECT_EQ(ids.values().col(s), pair(s));
    }
  }
}

// What the triangles of a spring are follows from where its ends lie.
TEST_P(Shell, SpringsNameTheTrianglesThatShareThem) {
  const Sheet sheet = make(grid_mesh(7, 5, 0.25));
  const auto is_on_outline = [&sheet](PetscInt a, PetscInt b) {
    const Eigen::Vector2d middle = (sheet.rest.col(a) + sheet.rest.col(b)).head<2>() / 2;
    return middle.minCoeff() < 1e-9 || middle.x() > 7 * 0.25 - 1e-9 || middle.y() > 5 * 0.25 - 1e-9;
  };
  std::array<std::vector<int>, 4> named;  // springs of each colour that name a triangle
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet.of(colour);
    std::vector<int>& count = named[static_cast<std::size_t>(colour)];
    count.assign(4 * sheet.cells.size(), 0);
    ASSERT_EQ(static_cast<PetscInt>(set.triangles.size()), set.local());
    for (PetscInt s = 0; s < set.local(); ++s) {
      const auto& [a, b] = set.ends[s];
      int triangles = 0;
      for (const PetscInt triangle : set.triangles[s]) {
        if (triangle < 0) {
          continue;
        }
        ++triangles;
        ASSERT_LT(triangle, static_cast<PetscInt>(count.size()));
        ++count[triangle];
        const auto& cell = sheet.cells[triangle / 4];
        const PetscInt lattice = sheet.lattice[triangle / 4];
        const PetscInt begin = cell[triangle % 4];
        const PetscInt end = cell[(triangle + 1) % 4];
        const auto is_corner = [&cell](PetscInt i) { return std::find(cell.begin(), cell.end(), i) != cell.end(); };
        if (colour == Colour::red) {
          EXPECT_TRUE((a == begin || a == end) && b == lattice);
        } else if (colour == Colour::blue) {
          EXPECT_EQ(std::minmax(a, b), std::minmax(begin, end));
        } else if (colour == Colour::yellow) {
          EXPECT_TRUE(is_corner(a) && is_corner(b));
        } else {
          EXPECT_TRUE(a == lattice || b == lattice);
          const PetscInt other = a == lattice ? b : a;  // as far beyond the edge as this lattice point before it
          EXPECT_NEAR((sheet.rest.col(lattice) + sheet.rest.col(other) - sheet.rest.col(begin) - sheet.rest.col(end))
                          .head<2>()
                          .norm(),
                      0, 1e-14);
        }
      }
      if (s < set.owned()) {
        const std::array<int, 4> expected{2, 2, is_on_outline(a, b) ? 1 : 2, 4};
        EXPECT_EQ(triangles, expected[static_cast<std::size_t>(colour)]);
      }
    }
  }
  for (std::size_t triangle = 0; triangle < 4 * static_cast<std::size_t>(sheet.elements.owned); ++triangle) {
    const auto& cell = sheet.cells[triangle / 4];
    const bool is_outer = is_on_outline(cell[triangle % 4], cell[(triangle + 1) % 4]);
    EXPECT_EQ(named[0][triangle], 2);
    EXPECT_EQ(named[1][triangle], is_outer ? 0 : 1);
    EXPECT_EQ(named[2][triangle], 1);
    EXPECT_EQ(named[3][triangle], 2);
  }
}

TEST_P(Shell, IdsEndBehindTheLastCellOfTheFile) {
  SurfaceMesh mesh = grid_mesh(3, 2, 0.25);
  EXPECT_EQ(make(mesh).id_end, 12 + 6);
  mesh.point_id = {0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 20};
  mesh.face_id = {1, 2, 3, 4, 5, 9};
  const Sheet sheet = make(mesh);
  EXPECT_EQ(sheet.first_lattice_id, 21);
  EXPECT_EQ(sheet.id_end, 21 + 9 + 1);
}

TEST_P(Shell, GhostParticlesCarryTheirOwnersData) {
  const Sheet sheet = make(grid_mesh(8, 8, 0.1));
  Field copy(sheet.particles, 5);
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    copy.values().col(i) << sheet.rest.col(i), sheet.initial_mass[i], sheet.persistent_id[i];
  }
  copy.update_ghosts();
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    EXPECT_EQ(copy.values().col(i).head<3>(), sheet.rest.col(i));
    EXPECT_EQ(copy.values()(3, i), sheet.initial_mass[i]);
    EXPECT_EQ(copy.values()(4, i), sheet.persistent_id[i]);
    // uv of the grid is proportional to the position.
    EXPECT_NEAR((sheet.uv.col(i) * 0.8 - sheet.rest.col(i).head<2>()).norm(), 0, 1e-14);
  }
}

TEST_P(Shell, FewerCellsThanRanksLeaveRanksEmpty) {
  const Sheet sheet = make(grid_mesh(2, 1, 0.1));
  EXPECT_EQ(sum(sheet.elements.owned), 2);
  EXPECT_EQ(sheet.of(Colour::green).layout.global, 1);
  EXPECT_EQ(sheet.of(Colour::blue).layout.global, 7);
  EXPECT_EQ(sum(sheet.particles.owned), 8);
}

TEST_P(Shell, PartitionIsBalanced) {
  const Sheet sheet = make(grid_mesh(20, 20, 0.1));
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  if (GetParam() == "metis") {
    EXPECT_LE(sheet.partition.imbalance, 1.1);
    EXPECT_LE(sheet.partition.edge_cut, 20 * ranks);
  }
  EXPECT_EQ(sheet.partition.edge_cut == 0, ranks == 1);
}

TEST_P(Shell, NeighboursAreNearInMemoryHoweverTheFileNumbersThem) {
  if (GetParam() == "simple") {
    GTEST_SKIP() << "parts by number alone are scattered over the surface";
  }
  constexpr int cells = 40;
  SurfaceMesh mesh = grid_mesh(cells, cells, 0.1);
  std::mt19937 random(7);
  std::vector<int> number(mesh.points.size());
  std::iota(number.begin(), number.end(), 0);
  std::shuffle(number.begin(), number.end(), random);
  const std::vector<Eigen::Vector3d> points = mesh.points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    mesh.points[number[i]] = points[i];
  }
  for (std::vector<int>& face : mesh.faces) {
    for (int& corner : face) {
      corner = number[corner];
    }
  }
  std::shuffle(mesh.faces.begin(), mesh.faces.end(), random);
  const Sheet sheet = make(mesh);
  for (const Colour colour : {Colour::blue, Colour::green, Colour::yellow}) {  // whose ends are of the same kind
    PetscInt widest = 0;
    for (const auto& [a, b] : sheet.of(colour).ends) {
      if (std::max(a, b) < sheet.particles.owned) {
        widest = std::max(widest, std::abs(a - b));
      }
    }
    EXPECT_LE(widest, 4 * cells) << "about two fronts";
  }
}

TEST_P(Shell, InitialNoiseDependsOnIdsAlone) {
  SheetOptions options;
  options.partitioner = GetParam();
  options.perturbation = 0.01;
  const Sheet whole = make_sheet(PETSC_COMM_SELF, grid_mesh(10, 10, 0.1), options);
  const Eigen::Matrix3Xd expected = perturbed_positions(whole, options);
  std::map<PetscInt, Eigen::Vector3d> position_of_id;
  for (PetscInt i = 0; i < whole.particles.owned; ++i) {
    position_of_id[whole.persistent_id[i]] = expected.col(i);
  }
  EXPECT_LE((expected - whole.rest).cwiseAbs().maxCoeff(), 0.001);
  EXPECT_GE((expected - whole.rest).cwiseAbs().mean(), 0.0004);
  EXPECT_NEAR((expected - whole.rest).mean(), 0, 1e-4);
  const Eigen::Matrix3Xd noise = expected - whole.rest;
  for (int direction = 0; direction < 3; ++direction) {
    EXPECT_GE((noise.row(direction) - noise.row((direction + 1) % 3)).cwiseAbs().mean(), 0.0004)
        << "the same in two directions";
  }

  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, grid_mesh(10, 10, 0.1), options);
  const Eigen::Matrix3Xd positions = perturbed_positions(sheet, options);
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    EXPECT_NEAR((positions.col(i) - position_of_id.at(sheet.persistent_id[i])).norm(), 0, 1e-15);
  }
}

}  // namespace
}  // namespace pellicle
