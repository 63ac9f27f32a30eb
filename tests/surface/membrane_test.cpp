#include "surface/membrane.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "base/sorting.h"
#include "meshing/generators.h"
#include "meshing/surface_mesh.h"
#include "meshing/triangulation.h"
#include "parallel/collective.h"
#include "parallel/field.h"
#include "tests/support/balls.h"

namespace pellicle {
namespace {

/// Numbers the points of a mesh anew, in a random order.
void shuffle_points(SurfaceMesh& mesh, std::mt19937& generator) {
  std::vector<int> target = numbers_up_to(mesh.points.size());
  std::shuffle(target.begin(), target.end(), generator);
  const std::vector<Eigen::Vector3d> points = mesh.points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    mesh.points[target[i]] = points[i];
  }
  const auto renumber = [&target](std::vector<int>& numbers) {
    std::transform(numbers.begin(), numbers.end(), numbers.begin(), [&target](int number) { return target[number]; });
  };
  std::for_each(mesh.faces.begin(), mesh.faces.end(), renumber);
  for (auto& group : mesh.groups) {
    renumber(group.second);
    group.second = without_repeats(std::move(group.second));
  }
}

/// A closed torus and an open rectangle in triangles, points and faces in a random order, with uv, groups and fields.
SurfaceMesh two_pieces() {
  SurfaceMesh mesh = joined(torus_mesh({12, 8}, 1, 0.4), rectangle_mesh({5, 4}, {2, 1}), {0, 0, 3});
  mesh.groups.clear();
  mesh.groups["none"];
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (mesh.points[i].x() > 0.5) {
      mesh.groups["right"].push_back(static_cast<int>(i));
    }
    if (mesh.points[i].y() > 0) {
      mesh.groups["behind"].push_back(static_cast<int>(i));  // some of which are right, too
    }
  }
  mesh = triangulated(mesh);
  std::mt19937 generator(3);
  shuffle_points(mesh, generator);
  for (std::size_t f = mesh.faces.size() - 1; f > 0; --f) {
    const std::size_t other = generator() % (f + 1);
    std::swap(mesh.faces[f], mesh.faces[other]);
    std::swap(mesh.uv[f], mesh.uv[other]);
  }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    mesh.face_fields["thickness"].push_back(1e-3 * static_cast<double>(f));
    mesh.face_fields["density"].push_back(1000 + static_cast<double>(f));
    if (f % 3 == 0) {
      mesh.face_groups["right"].push_back(static_cast<int>(f));
    }
  }
  mesh.face_groups["none"];
  return mesh;
}

Eigen::Vector3d area_vector(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return 0.5 * (b - a).cross(c - a);
}

/// Largest distance of two numbers in a triangle.
template <class Triangles>
int bandwidth(const Triangles& triangles) {
  int widest = 0;
  for (const auto& triangle : triangles) {
    const auto [low, high] = std::minmax_element(triangle.begin(), triangle.end());
    widest = std::max(widest, static_cast<int>(*high - *low));
  }
  return widest;
}

class MembraneTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { options_.partitioner = GetParam(); }
  Membrane make(const SurfaceMesh& mesh) { return make_membrane(PETSC_COMM_WORLD, mesh, options_); }

  static PetscInt sum(PetscInt value) {
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
    return value;
  }

  SheetOptions options_;
  SurfaceMesh mesh_ = two_pieces();
};

INSTANTIATE_TEST_SUITE_P(Partitioners, MembraneTest, ::testing::Values("metis", "ptscotch", "simple"));

TEST_P(MembraneTest, EveryTriangleIsOwnedOnceAndKeepsItsCorners) {
  const Membrane membrane = make(mesh_);
  EXPECT_EQ(membrane.elements.global, static_cast<PetscInt>(mesh_.faces.size()));
  EXPECT_EQ(membrane.particles.global, static_cast<PetscInt>(mesh_.points.size()));
  std::vector<int> owners(mesh_.faces.size(), 0);
  ASSERT_EQ(static_cast<PetscInt>(membrane.triangles.size()), membrane.elements.local());
  for (PetscInt e = 0; e < membrane.elements.local(); ++e) {
    const auto element = static_cast<std::size_t>(e);
    const auto id = static_cast<std::size_t>(membrane.element_id[element]);
    owners[id] += e < membrane.elements.owned ? 1 : 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const PetscInt corner = membrane.triangles[element][k];
      ASSERT_LT(corner, membrane.particles.local());
      EXPECT_EQ(membrane.persistent_id[corner], mesh_.faces[id][k]);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, owners.data(), static_cast<int>(owners.size()), MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_EQ(owners, std::vector<int>(mesh_.faces.size(), 1));
}

TEST_P(MembraneTest, ParticlesCarryTheDataOfTheirVertices) {
  const Membrane membrane = make(mesh_);
  std::map<int, std::vector<Eigen::Vector2d>> uv_of_point;
  for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      uv_of_point[mesh_.faces[f][k]].push_back(mesh_.uv[f][k]);
    }
  }
  EXPECT_TRUE(membrane.groups.at("none").empty());
  for (const char* group : {"right", "behind"}) {
    const std::set<int> ids(mesh_.groups.at(group).begin(), mesh_.groups.at(group).end());
    const std::set<PetscInt> members(membrane.groups.at(group).begin(), membrane.groups.at(group).end());
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      EXPECT_EQ(members.count(i), ids.count(membrane.persistent_id[i])) << group;
    }
  }
  for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
    const auto id = static_cast<int>(membrane.persistent_id[i]);
    EXPECT_EQ(membrane.rest.col(i), mesh_.points[id]);
    EXPECT_FALSE(membrane.is_lattice[i]);
    const auto& candidates = uv_of_point.at(id);
    EXPECT_NE(std::find(candidates.begin(), candidates.end(), Eigen::Vector2d(membrane.uv.col(i))), candidates.end());
  }
}

TEST_P(MembraneTest, ElementsCarryTheDataOfTheirFaces) {
  const Membrane membrane = make(mesh_);
  ASSERT_EQ(membrane.pieces(), 2);
  const auto is_on_torus = [this](std::size_t f) { return mesh_.points[mesh_.faces[f][0]].z() < 2; };
  EXPECT_EQ(membrane.piece_is_closed[is_on_torus(0) ? 0 : 1], true);
  EXPECT_EQ(membrane.piece_is_closed[is_on_torus(0) ? 1 : 0], false);
  ASSERT_EQ(membrane.element_fields.size(), 2U);
  std::vector<PetscInt> thirds;
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    if (membrane.element_id[e] % 3 == 0) {
      thirds.push_back(static_cast<PetscInt>(e));
    }
  }
  EXPECT_EQ(membrane.element_groups, thirds.empty() ? Groups() : Groups({{"right", thirds}}));
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    const auto f = static_cast<std::size_t>(membrane.element_id[e]);
    EXPECT_EQ(membrane.piece[e], is_on_torus(f) == is_on_torus(0) ? 0 : 1);
    EXPECT_EQ(membrane.element_fields.at("thickness")[e], mesh_.face_fields.at("thickness")[f]);
    EXPECT_EQ(membrane.element_fields.at("density")[e], mesh_.face_fields.at("density")[f]);
    const Eigen::Vector2d mean = (mesh_.uv[f][0] + mesh_.uv[f][1] + mesh_.uv[f][2]) / 3;
    EXPECT_NEAR((membrane.element_uv.col(static_cast<Eigen::Index>(e)) - mean).norm(), 0, 1e-15);
  }
}

TEST_P(MembraneTest, GhostsNameTheirOwnersItems) {
  const Membrane membrane = make(mesh_);
  Field position(membrane.particles, 3);
  position.values().leftCols(membrane.particles.owned) = membrane.rest.leftCols(membrane.particles.owned);
  position.update_ghosts();
  EXPECT_EQ(position.values(), Eigen::MatrixXd(membrane.rest));
  Field id(membrane.elements, 1);
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    id.values()(0, e) = membrane.element_id[e];
  }
  id.update_ghosts();
  for (PetscInt e = 0; e < membrane.elements.local(); ++e) {
    EXPECT_EQ(id.values()(0, e), membrane.element_id[e]);
  }
  std::vector<bool> used(membrane.particles.local(), false);
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    bool touches = static_cast<PetscInt>(e) < membrane.elements.owned;
    for (const PetscInt corner : membrane.triangles[e]) {
      used[corner] = true;
      touches = touches || corner < membrane.particles.owned;
    }
    EXPECT_TRUE(touches);
  }
  EXPECT_EQ(used, std::vector<bool>(used.size(), true));
}

// What a rank sums over its local elements is the whole of what acts on its vertices, as one rank would sum it.
TEST_P(MembraneTest, SumsOverLocalElementsAreComplete) {
  const Membrane membrane = make(mesh_);
  std::vector<Eigen::Vector3d> expected(mesh_.points.size(), Eigen::Vector3d::Zero());
  std::vector<int> count(mesh_.points.size(), 0);
  for (const std::vector<int>& face : mesh_.faces) {
    const auto at = [&](std::size_t k) { return mesh_.points[face[k]]; };
    for (const int point : face) {
      expected[point] += area_vector(at(0), at(1), at(2));
      ++count[point];
    }
  }
  Eigen::Matrix3Xd total = Eigen::Matrix3Xd::Zero(3, membrane.particles.local());
  for (const auto& [a, b, c] : membrane.triangles) {
    for (const PetscInt corner : {a, b, c}) {
      total.col(corner) += area_vector(membrane.rest.col(a), membrane.rest.col(b), membrane.rest.col(c));
    }
  }
  ASSERT_EQ(static_cast<PetscInt>(membrane.cell_count.size()), membrane.particles.owned);
  for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
    const auto id = static_cast<std::size_t>(membrane.persistent_id[i]);
    EXPECT_NEAR((total.col(i) - expected[id]).norm(), 0, 1e-15);
    EXPECT_EQ(membrane.cell_count[i], count[id]);
  }
}

TEST_P(MembraneTest, FewerElementsThanRanksLeaveRanksEmpty) {
  SurfaceMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  const Membrane membrane = make(mesh);
  EXPECT_EQ(sum(membrane.elements.owned), 2);
  EXPECT_EQ(sum(membrane.particles.owned), 4);
  EXPECT_EQ(membrane.pieces(), 1);
  EXPECT_FALSE(membrane.piece_is_closed[0]);
  EXPECT_EQ(membrane.element_uv.cols(), 0);
  EXPECT_EQ(membrane.uv.cols(), 0);
  EXPECT_TRUE(membrane.groups.empty());
  EXPECT_TRUE(membrane.element_fields.empty());
}

TEST_P(MembraneTest, IdsAreThoseOfTheFileAfterARepair) {
  SurfaceMesh mesh = mesh_;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    mesh.point_id.push_back(static_cast<int>(2 * i + 5));
  }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    mesh.face_id.push_back(static_cast<int>(3 * f + 1));
  }
  const Membrane membrane = make(mesh);
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    EXPECT_EQ(membrane.element_fields.at("density")[e], 1000 + (membrane.element_id[e] - 1) / 3);
  }
  for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
    const PetscInt id = membrane.persistent_id[i];
    EXPECT_EQ(membrane.rest.col(i), mesh_.points[(id - 5) / 2]);
  }
}

// 40 x 20 points on a torus in random order: fronts round the tube, two of 20 points that grow both ways, give the
// width.
TEST_P(MembraneTest, NeighboursAreNearInMemory) {
  SurfaceMesh mesh = triangulated(torus_mesh({40, 20}, 1, 0.4));
  mesh.uv.clear();
  std::mt19937 generator(5);
  shuffle_points(mesh, generator);
  std::shuffle(mesh.faces.begin(), mesh.faces.end(), generator);
  EXPECT_GT(bandwidth(mesh.faces), 700);
  const Membrane membrane = make_membrane(PETSC_COMM_SELF, mesh, options_);
  EXPECT_LE(bandwidth(membrane.triangles), 3 * 2 * 20);
  RecordProperty("bandwidth", bandwidth(membrane.triangles));
}

TEST_P(MembraneTest, PartitionIsBalanced) {
  const Membrane membrane = make(mesh_);
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  EXPECT_EQ(membrane.partition.edge_cut == 0, ranks == 1);
  if (GetParam() == "metis") {
    EXPECT_LE(membrane.partition.imbalance, 1.1);
    EXPECT_LE(membrane.partition.edge_cut, 30 * ranks);
  }
}

TEST_P(MembraneTest, InitialNoiseDependsOnIdsAlone) {
  options_.perturbation = 0.1;
  const Membrane whole = make_membrane(PETSC_COMM_SELF, mesh_, options_);
  const Eigen::Matrix3Xd expected = perturbed_positions(whole, options_);
  std::map<PetscInt, Eigen::Vector3d> position_of_id;
  for (PetscInt i = 0; i < whole.particles.owned; ++i) {
    position_of_id[whole.persistent_id[i]] = expected.col(i);
  }
  EXPECT_GE((expected - whole.rest).cwiseAbs().maxCoeff(), 0.02);
  const Membrane membrane = make(mesh_);
  const Eigen::Matrix3Xd positions = perturbed_positions(membrane, options_);
  for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
    const PetscInt id = membrane.persistent_id[i];
    EXPECT_NEAR((positions.col(i) - position_of_id.at(id)).norm(), 0, 1e-14);
  }
}

TEST(BurnableMembrane, MayHaveRanksWithoutElements) {
  Membrane membrane = make_membrane(PETSC_COMM_WORLD, triangulated(rectangle_mesh({1, 1}, {1, 1})), {});
  set_burnable(membrane, std::vector<double>(membrane.triangles.size(), 1.0));
  for (const SpringSet& set : membrane.springs) {
    const auto own = static_cast<PetscInt>(set.ends.size());
    EXPECT_EQ(set.layout.owned, own);
    EXPECT_EQ(set.layout.global, sum_over_ranks(PETSC_COMM_WORLD, own));
  }
}

}  // namespace
}  // namespace pellicle
