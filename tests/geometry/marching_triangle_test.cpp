#include "geometry/marching_triangle.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace pellicle {
namespace {

using Corners = std::array<Eigen::Vector3d, 3>;

Eigen::Vector3d place(const Corners& corners, const BorderPoint& point) {
  return (1 - point.t) * corners[point.from] + point.t * corners[point.to];
}

Eigen::Vector3d vector_area(const Corners& corners) {
  return (corners[1] - corners[0]).cross(corners[2] - corners[0]) / 2;
}

Eigen::Vector3d vector_area(const Corners& corners, const std::array<BorderPoint, 3>& triangle) {
  return vector_area({place(corners, triangle[0]), place(corners, triangle[1]), place(corners, triangle[2])});
}

/// The fraction of a triangle in which a linear level is not negative. One corner of that sign cuts off
/// l_a/(l_a - l_b) times l_a/(l_a - l_c).
double kept_share(const std::array<double, 3>& level) {
  const auto negative = [&](std::size_t i) { return level[i] < 0; };
  const int count = negative(0) + negative(1) + negative(2);
  if (count == 0 || count == 3) {
    return count == 0 ? 1 : 0;
  }
  std::size_t single = 0;
  while (negative(single) != (count == 1)) {
    ++single;
  }
  const double a = level[single];
  const double corner = a / (a - level[(single + 1) % 3]) * (a / (a - level[(single + 2) % 3]));
  return count == 1 ? 1 - corner : corner;
}

/// A triangle in space and levels of each of the 8 patterns of signs, again and again.
template <class Work>
void for_all_patterns(const Work& work) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(0.05, 1);
  for (int turn = 0; turn < 20; ++turn) {
    Corners corners;
    for (Eigen::Vector3d& corner : corners) {
      corner << number(random), number(random), number(random);
    }
    for (int pattern = 0; pattern < 8; ++pattern) {
      std::array<double, 3> level;
      for (int i = 0; i < 3; ++i) {
        level[i] = (pattern >> i & 1) != 0 ? number(random) : -number(random);
      }
      work(corners, level);
    }
  }
}

TEST(MarchingTriangle, AreasAreExactAndTurnedAsTheWhole) {
  for_all_patterns([](const Corners& corners, const std::array<double, 3>& level) {
    const KeptPart part = marching_triangle(level);
    const Eigen::Vector3d whole = vector_area(corners);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (PetscInt t = 0; t < part.count; ++t) {
      const Eigen::Vector3d area = vector_area(corners, part.triangles[t]);
      EXPECT_GT(area.dot(whole), 0);
      sum += area;
    }
    EXPECT_LT((sum - kept_share(level) * whole).norm(), 1e-14 * whole.norm())
        << level[0] << " " << level[1] << " " << level[2];
  });
}

TEST(MarchingTriangle, FourCasesHaveNoneOneOneAndTwoTriangles) {
  for_all_patterns([](const Corners&, const std::array<double, 3>& level) {
    const int kept = (level[0] >= 0) + (level[1] >= 0) + (level[2] >= 0);
    EXPECT_EQ(marching_triangle(level).count, (std::array{0, 1, 2, 1})[kept]);
  });
}

TEST(MarchingTriangle, PointsLieWhereTheLevelIsZero) {
  for_all_patterns([](const Corners&, const std::array<double, 3>& level) {
    const KeptPart part = marching_triangle(level);
    for (PetscInt t = 0; t < part.count; ++t) {
      for (const BorderPoint& point : part.triangles[t]) {
        const double from = level[point.from];
        const double to = level[point.to];
        EXPECT_GE(from, 0);
        if (point.from == point.to) {
          EXPECT_EQ(point.t, 0);
        } else {
          EXPECT_LT(to, 0);
          EXPECT_NEAR((1 - point.t) * from + point.t * to, 0, 1e-15);
        }
      }
    }
  });
}

TEST(MarchingTriangle, KeptAndBurntPartsAreTheWhole) {
  for_all_patterns([](const Corners& corners, const std::array<double, 3>& level) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const double sign : {1.0, -1.0}) {
      const KeptPart part = marching_triangle({sign * level[0], sign * level[1], sign * level[2]});
      for (PetscInt t = 0; t < part.count; ++t) {
        sum += vector_area(corners, part.triangles[t]);
      }
    }
    EXPECT_LT((sum - vector_area(corners)).norm(), 1e-14);
  });
}

// The neighbour beyond the edge from corner 0 to 1 runs along it the other way round, in whatever place it begins.
TEST(MarchingTriangle, NeighboursCutTheirEdgeAtTheSamePoint) {
  int cuts = 0;
  for_all_patterns([&cuts](const Corners& corners, const std::array<double, 3>& level) {
    const auto cut_places = [](const Corners& of, const std::array<double, 3>& at, int a, int b) {
      std::vector<std::array<double, 3>> places;
      const KeptPart part = marching_triangle(at);
      for (PetscInt t = 0; t < part.count; ++t) {
        for (const BorderPoint& point : part.triangles[t]) {
          if (std::minmax({point.from, point.to}) == std::minmax({a, b})) {
            const Eigen::Vector3d x = place(of, point);
            places.push_back({x.x(), x.y(), x.z()});
          }
        }
      }
      return places;
    };
    const auto own = cut_places(corners, level, 0, 1);
    for (int first = 0; first < 3; ++first) {  // Place of corner 1 in the neighbour.
      for (const double beyond : {0.3, -0.3}) {
        Corners neighbour;
        std::array<double, 3> level_there;
        const std::array<int, 3> at{first, (first + 1) % 3, (first + 2) % 3};
        for (const auto& [to, from] : {std::pair{0, 1}, {1, 0}}) {
          neighbour[at[to]] = corners[from];
          level_there[at[to]] = level[from];
        }
        neighbour[at[2]] << 2, 3, 4;
        level_there[at[2]] = beyond;
        const auto other = cut_places(neighbour, level_there, at[0], at[1]);
        EXPECT_EQ(own.empty(), other.empty());
        for (const auto& place_there : other) {
          EXPECT_EQ(place_there, own.front()) << "the same to the last bit";
          ++cuts;
        }
      }
    }
  });
  EXPECT_GT(cuts, 0);
}

TEST(MarchingTriangle, ZeroIsKept) {
  EXPECT_EQ(marching_triangle({0, 0, 0}).count, 1);
  const KeptPart edge = marching_triangle({0, 0, -1});
  const Corners corners{Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0)};
  for (PetscInt t = 0; t < edge.count; ++t) {
    EXPECT_EQ(vector_area(corners, edge.triangles[t]).norm(), 0);
  }
}

}  // namespace
}  // namespace pellicle
