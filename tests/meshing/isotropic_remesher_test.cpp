#include "meshing/isotropic_remesher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <stdexcept>

namespace pellicle {
namespace {

TEST(IsotropicRemesher, NeedlesGetNoPointsWithoutEnd) {
  // Both sides of a plane surface. On each two needles have their points on a line, at 0, 1, 2 and 3: the middle of 0
  // and 2 is at 1, that of this new point and 3 at 2, that of this one and 0 at 1 again.
  const std::vector<std::vector<int>> faces{{0, 2, 1}, {0, 3, 2}, {3, 0, 8}, {8, 0, 7}, {0, 1, 4},
                                            {1, 2, 4}, {2, 3, 4}, {7, 0, 5}, {8, 7, 5}, {3, 8, 5},
                                            {0, 4, 6}, {4, 3, 6}, {3, 5, 6}, {5, 0, 6}};
  std::mt19937 random(1);
  for (int order = 0; order < 200; ++order) {
    SurfaceMesh mesh;
    mesh.points = {{0, 0, 0},    {1, 0, 0},   {2, 0, 0}, {3, 0, 0}, {1.5, 1, 0},
                   {1.5, -1, 0}, {1.5, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    mesh.faces = faces;
    std::shuffle(mesh.faces.begin(), mesh.faces.end(), random);
    for (std::vector<int>& face : mesh.faces) {
      std::rotate(face.begin(), face.begin() + static_cast<int>(random() % 3), face.end());
    }
    int calls = 0;
    const auto height = [&calls](const Eigen::Vector3d& point) {
      if (++calls > 10000) {
        throw std::runtime_error("points without end");
      }
      return point.z();
    };
    const ImplicitSurface plane{height, Eigen::AlignedBox3d(Eigen::Vector3d(0, -1, -1), Eigen::Vector3d(3, 1, 1))};
    IsotropicRemesher remesher(mesh, plane, "it");
    EXPECT_NO_THROW(remesher.remesh(1.4)) << order;
  }
}

}  // namespace
}  // namespace pellicle
