#include "contact/contact_mesh.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <algorithm>
#include <map>
#include <set>

#include "tests/contact/facing_surfaces.h"

namespace pellicle {
namespace {

using Name = std::vector<PetscInt>;  // of a point, see FacingSurfaces::name_of
using Element = FacingSurfaces::Element;

class ContactMeshTest : public ::testing::Test {
 protected:
  ContactMeshTest() { MPI_Comm_rank(PETSC_COMM_WORLD, &rank_); }

  bool is_own(PetscInt number) const { return scene_.owner[number] == rank_; }
  bool lives(const Element& element) const {
    return std::find(element.lives.begin(), element.lives.end(), true) != element.lives.end();
  }
  bool touches_own(const Element& element) const {
    return std::any_of(element.corners.begin(), element.corners.end(), [this](PetscInt i) { return is_own(i); });
  }

  Eigen::AlignedBox3d box_of(const Name& particles) const {
    Eigen::AlignedBox3d box;
    for (const PetscInt i : particles) {
      box.extend(scene_.place(i) + scene_.least(i));
      box.extend(scene_.place(i) + scene_.greatest(i));
    }
    const double wider = FacingSurfaces::thickness[scene_.part_of(particles[0])] / 2;
    return {box.min().array() - wider, box.max().array() + wider};
  }

  /// The surface triangles that live, by the names of their corners, in order.
  std::vector<std::array<Name, 3>> drawn(const Element& element) const {
    std::vector<std::array<Name, 3>> result;
    const auto& corners = element.corners;
    if (corners.size() == 3) {
      result.push_back({Name{corners[0]}, {corners[1]}, {corners[2]}});
    } else {
      Name centre = corners;
      std::sort(centre.begin(), centre.end());
      for (std::size_t t = 0; t < 4; ++t) {
        if (element.lives[t]) {
          result.push_back({Name{corners[t]}, {corners[(t + 1) % 4]}, centre});
        }
      }
    }
    return result;
  }

  /// The triangles of a mesh, by the names of their corners.
  std::vector<std::array<Name, 3>> triangles_of(const ContactMesh& mesh) const {
    const std::vector<PetscInt> numbers = scene_.numbers_in(mesh);
    std::vector<std::array<Name, 3>> result;
    for (const auto& triangle : mesh.triangles()) {
      std::array<Name, 3>& names = result.emplace_back();
      std::transform(triangle.begin(), triangle.end(), names.begin(),
                     [&](PetscInt point) { return FacingSurfaces::name_of(mesh, numbers, point); });
    }
    return result;
  }

  /// That all that may touch an owned particle is there, once.
  void expect_all_that_is_near(const ContactMesh& mesh) const {
    std::map<std::array<Name, 3>, int> count;
    for (const std::array<Name, 3>& triangle : triangles_of(mesh)) {
      ++count[triangle];
    }
    std::vector<Eigen::AlignedBox3d> boxes;
    std::vector<Eigen::AlignedBox3d> own;
    for (const Element& element : scene_.elements) {
      boxes.push_back(box_of(element.corners));
      if (lives(element) && touches_own(element)) {
        own.push_back(boxes.back());
      }
    }
    int near = 0;
    for (std::size_t e = 0; e < boxes.size(); ++e) {
      const bool is_near = lives(scene_.elements[e]) && std::any_of(own.begin(), own.end(), [&](const auto& box) {
                             return box.intersects(boxes[e]);
                           });
      near += is_near && !touches_own(scene_.elements[e]) ? 1 : 0;
      for (const std::array<Name, 3>& triangle : drawn(scene_.elements[e])) {
        const auto found = count.find(triangle);
        EXPECT_LE(is_near ? 1 : 0, found == count.end() ? 0 : found->second) << "element " << e;
        if (found != count.end()) {
          EXPECT_EQ(found->second, 1) << "element " << e;
          count.erase(found);
        }
      }
    }
    EXPECT_TRUE(count.empty()) << count.size() << " triangles are none of those that live";
    int ranks = 1;
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    EXPECT_EQ(on_any_rank(PETSC_COMM_WORLD, near > 0), ranks > 1);
  }

  FacingSurfaces scene_{0.3, 0.009};
  int rank_ = 0;
};

TEST_F(ContactMeshTest, GathersTheTrianglesWhoseBoxesMeetFromAllRanks) {
  ContactMesh mesh(scene_.surface);
  EXPECT_TRUE(mesh.triangles().empty());
  const bool is_same = mesh.gather(scene_.motion(scene_.all_new()), scene_.start, {});
  EXPECT_FALSE(is_same && !mesh.triangles().empty());
  expect_all_that_is_near(mesh);
  // And not all that there is.
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  std::size_t all = 0;
  for (const Element& element : scene_.elements) {
    all += drawn(element).size();
  }
  const auto least =
      static_cast<std::size_t>(min_over_ranks(PETSC_COMM_WORLD, static_cast<int>(mesh.triangles().size())));
  EXPECT_EQ(least<all, ranks> 1);
}

TEST_F(ContactMeshTest, LeavesOutWhatHasDied) {
  for (std::size_t e = 0; e < scene_.elements.size(); ++e) {
    auto& lives = scene_.elements[e].lives;
    for (std::size_t t = 0; t < lives.size(); ++t) {
      lives[t] = lives.size() == 1 ? e % 5 != 0 : e % 4 == 0 ? false : (e + t) % 7 != 0;
    }
  }
  scene_.let_die();
  ContactMesh mesh(scene_.surface);
  mesh.gather(scene_.motion(scene_.all_new()), scene_.start, {});
  expect_all_that_is_near(mesh);
}

TEST_F(ContactMeshTest, KnowsOfEveryPointWhatItsSurfaceKnows) {
  ContactMesh mesh(scene_.surface);
  mesh.gather(scene_.motion(scene_.all_new()), scene_.start, {});
  std::map<Name, double> area;
  for (const Element& element : scene_.elements) {
    const bool is_quad = element.corners.size() == 4;
    for (const PetscInt corner : element.corners) {
      area[{corner}] += element.area / (is_quad ? 8 : 3);
    }
    if (is_quad) {
      area[drawn(element)[0][2]] = element.area / 2;
    }
  }
  const std::vector<PetscInt> numbers = scene_.numbers_in(mesh);
  const auto mean = [](const Name& name, const auto& of) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const PetscInt i : name) {
      sum += of(i) / static_cast<double>(name.size());
    }
    return sum;
  };
  Field moved(scene_.surface.particles(), 3);  // Its ghosts are not up to date.
  for (PetscInt i = 0; i < scene_.surface.particles().owned; ++i) {
    moved.vector(i) = FacingSurfaces::some_vector(numbers[i], 4);
  }
  Eigen::Matrix3Xd places;
  mesh.write_points(moved, places);
  ASSERT_EQ(places.cols(), mesh.points());
  std::set<Name> seen;
  for (const auto& triangle : mesh.triangles()) {
    for (const PetscInt number : triangle) {
      const ContactMesh::Point& point = mesh.point(number);
      const Name name = FacingSurfaces::name_of(mesh, numbers, number);
      if (!seen.insert(name).second) {
        continue;
      }
      const std::size_t part = scene_.part_of(name[0]);
      EXPECT_LT((point.rest - mean(name, [&](PetscInt i) { return scene_.rest.col(i); })).norm(), 1e-14);
      EXPECT_LT((point.start - mean(name, [&](PetscInt i) { return scene_.start_place(i); })).norm(), 1e-14);
      const Eigen::Vector3d low = mean(name, [&](PetscInt i) { return scene_.least(i); });
      const Eigen::Vector3d high = mean(name, [&](PetscInt i) { return scene_.greatest(i); });
      EXPECT_LT((point.low - low).norm(), 1e-14);
      EXPECT_LT((point.high - high).norm(), 1e-14);
      EXPECT_NEAR(point.area, area.at(name), 1e-14);
      EXPECT_EQ(point.thickness, FacingSurfaces::thickness[part]);
      EXPECT_EQ(point.stiffness, FacingSurfaces::stiffness[part]);
      EXPECT_EQ(point.is_own, std::any_of(name.begin(), name.end(), [this](PetscInt i) { return is_own(i); }));
      EXPECT_TRUE(point.is_new);
      const Eigen::Vector3d place = mean(name, [&](PetscInt i) { return scene_.place(i); });
      const Eigen::Array3d wider = Eigen::Array3d::Constant(FacingSurfaces::thickness[part] / 2);
      constexpr double rounding = 1e-6;  // The box is in floats.
      const Eigen::Array3d below = (place + low).array() - wider - point.box.low.head<3>().cast<double>();
      const Eigen::Array3d above = point.box.high.head<3>().cast<double>() - (place + high).array() - wider;
      EXPECT_GE(std::min(below.minCoeff(), above.minCoeff()), 0);
      EXPECT_LT(std::max(below.maxCoeff(), above.maxCoeff()), rounding);
      EXPECT_LT((places.col(number) - mean(name, [](PetscInt i) { return FacingSurfaces::some_vector(i, 4); })).norm(),
                1e-14);
    }
  }
  const auto own_of = [this](const Name& name) {
    return std::any_of(name.begin(), name.end(), [this](PetscInt i) { return is_own(i); });
  };
  EXPECT_TRUE(std::all_of(area.begin(), area.end(),
                          [&](const auto& point) { return !own_of(point.first) || seen.count(point.first) == 1; }));
}

TEST_F(ContactMeshTest, OneTriangleStandsForEachPointAndSide) {
  ContactMesh mesh(scene_.surface);
  mesh.gather(scene_.motion(scene_.all_new()), scene_.start, {});
  std::map<std::set<PetscInt>, int> leaders;
  for (std::size_t t = 0; t < mesh.triangles().size(); ++t) {
    const auto& triangle = mesh.triangles()[t];
    for (std::size_t k = 0; k < 3; ++k) {
      leaders[{triangle[k]}] += mesh.leads()[t].point[k] ? 1 : 0;
      leaders[{triangle[k], triangle[(k + 1) % 3]}] += mesh.leads()[t].side[k] ? 1 : 0;
    }
  }
  for (const auto& [points, count] : leaders) {
    EXPECT_EQ(count, 1) << (points.size() == 1 ? "point " : "side from ") << *points.begin();
  }
}

TEST_F(ContactMeshTest, TellsWhatIsNewWhereASearchIsRenewed) {
  ContactMesh mesh(scene_.surface);
  mesh.gather(scene_.motion(scene_.all_new()), scene_.start, {});
  const std::vector<PetscInt> numbers = scene_.numbers_in(mesh);
  const auto before = mesh.triangles();
  std::vector<bool> is_new = scene_.all_new();
  for (std::size_t i = 0; i < is_new.size(); ++i) {
    is_new[i] = numbers[i] % 5 == 0;
  }
  EXPECT_TRUE(mesh.gather(scene_.motion(is_new), scene_.start, {}));
  EXPECT_EQ(mesh.triangles(), before);
  for (const auto& triangle : mesh.triangles()) {
    for (const PetscInt number : triangle) {
      const Name name = FacingSurfaces::name_of(mesh, numbers, number);
      EXPECT_EQ(mesh.point(number).is_new,
                std::any_of(name.begin(), name.end(), [](PetscInt i) { return i % 5 == 0; }));
    }
  }
}

TEST_F(ContactMeshTest, ReachesFurtherParticlesThatAreAskedFor) {
  ContactMesh mesh(scene_.surface);
  std::vector<PetscInt> asked(static_cast<std::size_t>(scene_.all_particles()), 0);  // all, by their global numbers
  const std::vector<PetscInt> own = scene_.numbers();
  for (PetscInt i = 0; i < scene_.surface.particles().owned; ++i) {
    asked[own[i]] = scene_.surface.particles().to_global(i);
  }
  sum_over_ranks(PETSC_COMM_WORLD, asked);
  mesh.gather(scene_.motion(scene_.all_new()), scene_.start, {});
  const bool has_all =
      std::all_of(asked.begin(), asked.end(), [&mesh](PetscInt global) { return mesh.find(global) >= 0; });
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  EXPECT_EQ(on_any_rank(PETSC_COMM_WORLD, !has_all), ranks > 1);
  mesh.gather(scene_.motion(scene_.all_new()), scene_.start, asked);
  const std::vector<PetscInt> numbers = scene_.numbers_in(mesh);
  for (std::size_t number = 0; number < asked.size(); ++number) {
    ASSERT_GE(mesh.find(asked[number]), 0);
    EXPECT_EQ(numbers[mesh.find(asked[number])], number);
  }
  std::vector<bool> in_triangle(numbers.size(), false);
  for (const auto& triangle : mesh.triangles()) {
    for (const PetscInt point : triangle) {
      for (const PetscInt i : mesh.particles(point)) {
        in_triangle[i] = true;
      }
    }
  }
  for (PetscInt i = 0; i < mesh.reach().local(); ++i) {
    EXPECT_EQ(mesh.has(i), in_triangle[i]) << "particle " << numbers[i];
  }
}

}  // namespace
}  // namespace pellicle
