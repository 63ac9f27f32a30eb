#include "contact/contact_pairs.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "contact/crack_faces.h"
#include "tests/contact/facing_surfaces.h"

namespace pellicle {
namespace {

/// What a pair is known by on all ranks: whether it is of edges, and the names of its features' points (see
/// FacingSurfaces::name_of), each feature's in rising order; of two edges the lesser one comes first.
using PairName = std::tuple<bool, std::vector<std::vector<PetscInt>>, std::vector<std::vector<PetscInt>>>;

class ContactPairsTest : public ::testing::Test {
 protected:
  using Name = std::vector<PetscInt>;
  /// A corner, or a centre, of both surfaces.
  struct Point {
    Eigen::Vector3d rest = Eigen::Vector3d::Zero();
    Eigen::Vector3d start = Eigen::Vector3d::Zero();
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    Eigen::Vector3d low = Eigen::Vector3d::Zero();
    Eigen::Vector3d high = Eigen::Vector3d::Zero();
    std::size_t part = 0;
    double area = 0;
    bool is_own = false;
  };

  static PairName name_of(bool are_edges, std::vector<Name> first, std::vector<Name> second) {
    std::sort(first.begin(), first.end());
    std::sort(second.begin(), second.end());
    if (are_edges && second < first) {
      std::swap(first, second);
    }
    return {are_edges, first, second};
  }

  /// All points and surface triangles of both surfaces, on every rank.
  void draw(const FacingSurfaces& scene) {
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    const auto point = [&](const Name& name) -> Point& {
      const auto [found, is_fresh] = points_.try_emplace(name);
      if (is_fresh) {
        found->second.part = scene.part_of(name[0]);
        const double weight = 1 / static_cast<double>(name.size());
        for (const PetscInt i : name) {
          found->second.rest += weight * scene.rest.col(i);
          found->second.start += weight * scene.start_place(i);
          found->second.place += weight * scene.place(i);
          found->second.low += weight * scene.least(i);
          found->second.high += weight * scene.greatest(i);
          found->second.is_own = found->second.is_own || scene.owner[i] == rank;
        }
      }
      return found->second;
    };
    for (const FacingSurfaces::Element& element : scene.elements) {
      const auto& corners = element.corners;
      const bool is_quad = corners.size() == 4;
      for (const PetscInt corner : corners) {
        point({corner}).area += element.area / (is_quad ? 8 : 3);
      }
      if (!is_quad) {
        triangles_.push_back({Name{corners[0]}, {corners[1]}, {corners[2]}});
        continue;
      }
      Name centre = corners;
      std::sort(centre.begin(), centre.end());
      point(centre).area = element.area / 2;
      for (std::size_t t = 0; t < 4; ++t) {
        triangles_.push_back({Name{corners[t]}, {corners[(t + 1) % 4]}, centre});
      }
    }
  }

  /// The pair of these features, if this rank has to have it.
  void look_at(bool are_edges, const std::vector<Name>& first, const std::vector<Name>& second) {
    std::array<const Point*, 4> of{};
    std::size_t k = 0;
    for (const auto* feature : {&first, &second}) {
      for (const Name& name : *feature) {
        of[k++] = &points_.at(name);
      }
    }
    const std::size_t split = first.size();
    const auto corners = [&of](Eigen::Vector3d Point::*at) {
      return std::array<Eigen::Vector3d, 4>{of[0]->*at, of[1]->*at, of[2]->*at, of[3]->*at};
    };
    const auto apart = [&](const std::array<Eigen::Vector3d, 4>& places) {
      return (are_edges ? nearest_of_edges(places) : nearest_of_point_and_triangle(places)).apart;
    };
    const Eigen::Vector3d displacement = apart(corners(&Point::place));
    const double distance = displacement.norm();
    std::array<double, 2> nearer{-1, -1};
    for (std::size_t i = 0; i < 4; ++i) {
      for (int corner = 0; corner < 8; ++corner) {  // of the box of its displacements
        Eigen::Vector3d to;
        for (int axis = 0; axis < 3; ++axis) {
          to[axis] = (corner >> axis) % 2 == 0 ? of[i]->low[axis] : of[i]->high[axis];
        }
        nearer[i < split ? 0 : 1] =
            std::max(nearer[i < split ? 0 : 1], (i < split ? -1 : 1) * displacement.dot(to) / distance);
      }
    }
    const double nearest = distance - nearer[0] - nearer[1];
    const double thickness = (FacingSurfaces::thickness[of[0]->part] + FacingSurfaces::thickness[of[2]->part]) / 2;
    const double rest = apart(corners(&Point::rest)).norm();
    const bool are_lips = rest / 2 < 1e-3 * thickness;
    const double presses_from = are_lips ? lip_share * thickness : std::min(thickness, rest / 2);
    const bool is_owned = std::any_of(of.begin(), of.end(), [](const Point* point) { return point->is_own; });
    if (!is_owned || nearest >= thickness || nearest >= std::max(presses_from, (1 - room_share) * distance)) {
      return;
    }
    double fraction = are_lips ? 1 / (lip_share * lip_share) : 1;
    double area = of[0]->area / 2;
    if (are_edges) {
      const Eigen::Vector3d one = of[1]->start - of[0]->start;
      const Eigen::Vector3d other = of[3]->start - of[2]->start;
      const double least_sine = std::min(0.1, presses_from / std::max(one.norm(), other.norm()));
      const double c = std::min(1.0, std::pow(one.cross(other).norm() / (one.norm() * other.norm() * least_sine), 2));
      fraction *= c * (2 - c);
      area = (of[0]->area + of[1]->area + of[2]->area + of[3]->area) / 16;
    }
    const double stiffness =
        fraction * area * std::min(FacingSurfaces::stiffness[of[0]->part], FacingSurfaces::stiffness[of[2]->part]);
    expected_[name_of(are_edges, first, second)] = {distance, presses_from, stiffness, nearest < presses_from};
  }

  /// Looks at all features, with no search.
  void look_at_all() {
    std::set<std::pair<Name, Name>> sides;
    for (const auto& triangle : triangles_) {
      for (std::size_t k = 0; k < 3; ++k) {
        sides.insert(std::minmax(triangle[k], triangle[(k + 1) % 3]));
      }
    }
    for (const auto& triangle : triangles_) {
      const std::vector<Name> corners(triangle.begin(), triangle.end());
      for (const auto& [name, point] : points_) {
        if (std::find(corners.begin(), corners.end(), name) == corners.end()) {
          look_at(false, {name}, corners);
        }
      }
    }
    for (auto one = sides.begin(); one != sides.end(); ++one) {
      for (auto other = std::next(one); other != sides.end(); ++other) {
        const auto& [a, b] = *one;
        const auto& [c, d] = *other;
        if (a != c && a != d && b != c && b != d) {
          look_at(true, {a, b}, {c, d});
        }
      }
    }
  }

  void expect_the_expected(const FacingSurfaces& scene, const ContactMesh& mesh,
                           const std::vector<ContactPair>& pairs) const {
    const std::vector<PetscInt> numbers = scene.numbers_in(mesh);
    std::set<PairName> found;
    for (const ContactPair& pair : pairs) {
      std::array<std::vector<Name>, 2> features;
      for (int k = 0; k < 4; ++k) {
        features[k < pair.first_feature() ? 0 : 1].push_back(FacingSurfaces::name_of(mesh, numbers, pair.points[k]));
      }
      const PairName name = name_of(pair.are_edges, features[0], features[1]);
      EXPECT_TRUE(found.insert(name).second) << "a pair comes twice";
      const auto expected = expected_.find(name);
      if (expected == expected_.end()) {
        ADD_FAILURE() << "a pair that is none, at a distance of " << pair.distance;
        continue;
      }
      const auto& [distance, thickness, stiffness, may_press] = expected->second;
      EXPECT_NEAR(pair.distance, distance, 1e-14);
      EXPECT_NEAR(pair.barrier.thickness, thickness, 1e-14);
      EXPECT_NEAR(pair.barrier.stiffness, stiffness, 1e-9 * stiffness + 1e-9);
      EXPECT_GT(pair.barrier.steep, 0);
      EXPECT_EQ(pair.may_press, may_press);
    }
    EXPECT_EQ(found.size(), expected_.size());
    const auto edges = static_cast<std::size_t>(
        std::count_if(pairs.begin(), pairs.end(), [](const ContactPair& pair) { return pair.are_edges; }));
    EXPECT_GT(edges, 20U);
    EXPECT_GT(pairs.size() - edges, 20U);
  }

  void expect_the_pairs_of_a_search_without_boxes(double lift, double gap) {
    FacingSurfaces scene(lift, gap);
    ContactMesh mesh(scene.surface);
    mesh.gather(scene.motion(scene.all_new()), scene.start, {});
    Eigen::Matrix3Xd places;
    mesh.write_points(scene.x, places);
    draw(scene);
    look_at_all();
    std::vector<ContactPair> pairs;
    EXPECT_FALSE(renew_contact_pairs(mesh, places, pairs));
    expect_the_expected(scene, mesh, pairs);

    // And again, where only a third of the particles may go where they could not.
    std::vector<bool> is_new = scene.all_new();
    const std::vector<PetscInt> numbers = scene.numbers();
    for (std::size_t i = 0; i < is_new.size(); ++i) {
      is_new[i] = numbers[i] % 3 == 0;
    }
    ASSERT_TRUE(mesh.gather(scene.motion(is_new), scene.start, {}));
    EXPECT_FALSE(renew_contact_pairs(mesh, places, pairs));
    expect_the_expected(scene, mesh, pairs);
  }

  struct Expected {
    double distance;
    double thickness;
    double stiffness;
    bool may_press;
  };
  std::map<Name, Point> points_;
  std::vector<std::array<Name, 3>> triangles_;
  std::map<PairName, Expected> expected_;
};

TEST_F(ContactPairsTest, AreThoseOfASearchThroughAllFeatures) {
  expect_the_pairs_of_a_search_without_boxes(0.02, 0.009);
}

TEST_F(ContactPairsTest, OfFeaturesThatAreInOnePlaceUndeformedPressLate) {
  expect_the_pairs_of_a_search_without_boxes(0, 0.002);
}

TEST_F(ContactPairsTest, AreNoneOfFeaturesThatTouch) {
  FacingSurfaces scene(0.02, 0);
  for (PetscInt i = 0; i < scene.surface.particles().local(); ++i) {
    scene.x.vector(i).z() = 0;
  }
  ContactMesh mesh(scene.surface);
  mesh.gather(scene.motion(scene.all_new()), scene.start, {});
  Eigen::Matrix3Xd places;
  mesh.write_points(scene.x, places);
  std::vector<ContactPair> pairs;
  EXPECT_TRUE(on_any_rank(PETSC_COMM_WORLD, renew_contact_pairs(mesh, places, pairs)));
  for (const ContactPair& pair : pairs) {
    EXPECT_GT(pair.distance, 1e-12);
  }
}

/// Whether two equal sheets touch, of which the second is shifted in their plane.
bool sheets_touch(double shift) {
  const SurfaceMesh mesh = grid_mesh(3, 2, 0.1);
  const Sheet first = make_sheet(PETSC_COMM_WORLD, mesh, SheetOptions());
  const Sheet second = make_sheet(PETSC_COMM_WORLD, moved(mesh, {shift, 0.7 * shift, 0}), SheetOptions());
  const ContactSurface surface({{&first, 0.01, 1e6}, {&second, 0.01, 1e6}});
  Field x(surface.particles(), 3);
  for (std::size_t part = 0; part < 2; ++part) {
    const Sheet& sheet = part == 0 ? first : second;
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      x.vector(surface.joined().local(part, i)) = sheet.rest.col(i);
    }
  }
  const Field range(surface.particles(), 3);
  ContactMesh contact_mesh(surface);
  contact_mesh.gather({x, range, range, std::vector<bool>(surface.particles().local(), true)}, x, {});
  Eigen::Matrix3Xd places;
  contact_mesh.write_points(x, places);
  std::vector<ContactPair> pairs;
  return on_any_rank(PETSC_COMM_WORLD, renew_contact_pairs(contact_mesh, places, pairs));
}

TEST(ContactPairs, TouchUnlessAPointOfOneIsInThePlaceOfAPointOfTheOther) {
  EXPECT_FALSE(sheets_touch(0));
  EXPECT_TRUE(sheets_touch(0.03));
}

/// Points and what they make, as columns; the triangle and the second edge are near the plane of x and y.
struct PairCase {
  const char* name;
  bool are_edges;
  std::array<Eigen::Vector3d, 4> corners;
};
const std::vector<PairCase> pair_cases{
    {"a point over a triangle", false, {{{0.3, 0.2, 0.4}, {0, 0, 0}, {1, 0.1, 0}, {0.2, 1, 0.1}}}},
    {"a point beside a triangle's side", false, {{{0.5, -0.4, 0.3}, {0, 0, 0}, {1, 0.1, 0}, {0.2, 1, 0.1}}}},
    {"a point beyond a corner", false, {{{1.5, 0.2, 0.3}, {0, 0, 0}, {1, 0.1, 0}, {0.2, 1, 0.1}}}},
    {"edges that cross", true, {{{0.4, -1, 0.3}, {0.5, 1.2, 0.5}, {-1, 0.1, 0}, {1.1, 0, 0.1}}}},
    {"an end over an edge", true, {{{0.2, 0.3, 0.4}, {0.4, 1.2, 0.9}, {-1, 0.1, 0}, {1.1, 0, 0.1}}}},
    {"an edge over an end", true, {{{-0.5, 2, 0.4}, {0.7, 2.2, 0.5}, {0.1, 0.3, 0}, {0, 1.1, 0.1}}}},
    {"two ends", true, {{{1.5, 0.4, 0.3}, {2.5, 1.2, 0.5}, {-1, 0.1, 0}, {1.1, 0, 0.1}}}}};

Eigen::Matrix3Xd places_of(const PairCase& given) {
  Eigen::Matrix3Xd places(3, 5);
  places << given.corners[0], given.corners[1], Eigen::Vector3d::Zero(), given.corners[2], given.corners[3];
  return places;
}
ContactPair pair_of(const PairCase& given) {
  ContactPair pair;
  pair.points = {0, 1, 3, 4};  // All but one.
  pair.are_edges = given.are_edges;
  return pair;
}

TEST(ContactPair, HasTheCurvatureOfItsGap) {
  for (const PairCase& given : pair_cases) {
    SCOPED_TRACE(given.name);
    const ContactPair pair = pair_of(given);
    const Eigen::Matrix3Xd places = places_of(given);
    const auto gap = [&](int i, double by, int j, double also) {
      Eigen::Matrix3Xd moved = places;
      moved(i % 3, pair.points[i / 3]) += by;
      moved(j % 3, pair.points[j / 3]) += also;
      ContactPair measured = pair;
      measured.measure(moved);
      return measured.distance;
    };
    const auto slope = [](const auto& function) {  // without error up to the fourth power
      constexpr double h = 2e-3;
      return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h);
    };
    Eigen::Matrix<double, 12, 12> expected;
    for (int i = 0; i < 12; ++i) {
      for (int j = 0; j < 12; ++j) {
        expected(i, j) = slope([&](double by) { return slope([&](double also) { return gap(i, by, j, also); }); });
      }
    }
    EXPECT_LT((pair.gap_curvature(places) - expected).cwiseAbs().maxCoeff(), 1e-7);
  }
}

TEST(ContactPair, IsNeverNearerThanItsSeparation) {
  for (const PairCase& given : pair_cases) {
    SCOPED_TRACE(given.name);
    ContactPair pair = pair_of(given);
    const Eigen::Matrix3Xd places = places_of(given);
    pair.measure(places);
    EXPECT_NEAR(pair.normal.norm(), 1, 1e-15);
    EXPECT_NEAR(pair.separation(places), pair.distance, 1e-14);
    for (int time = 0; time < 50; ++time) {
      Eigen::Matrix3Xd moved = places;
      for (Eigen::Index i = 0; i < moved.size(); ++i) {
        moved(i) += 0.3 * std::sin(3.0 * static_cast<double>(i * i) + 7 * time);
      }
      EXPECT_LE(pair.separation(moved), pair.nearest(moved).apart.norm() + 1e-14);
    }
    // Where the first feature moves along the normal, the separation grows by as much.
    Eigen::Matrix3Xd away = places;
    for (int k = 0; k < pair.first_feature(); ++k) {
      away.col(pair.points[k]) += 0.25 * pair.normal;
    }
    EXPECT_NEAR(pair.separation(away), pair.distance + 0.25, 1e-14);
  }
}

}  // namespace
}  // namespace pellicle
