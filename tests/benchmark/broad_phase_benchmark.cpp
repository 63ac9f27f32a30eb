// What it costs to find which triangles are near each other, from their boxes, by number of triangles:
//
//     build/release/tests/benchmark_pellicle --benchmark_filter=broad_phase
//
// - pellicle: geometry/box_tree.h, as contact searches with it: the tree is built and all pairs of boxes that meet are
//   visited
// - bullet: btDbvt, a tree of bounding volumes, built at once (optimizeTopDown) and collided with itself, as Bullet
// does
//   between the faces of soft bodies
// - cgal: box_self_intersection_d, a hybrid of segment trees and sweeps
//
// The last two are there if their packages (libbullet-dev, libcgal-dev) were when CMake ran; the Bullet of Debian
// counts in float, as the tree of pellicle does. The surface is a cloth that is rolled up, its layers half a side of
// its triangles apart, so that each triangle is near those of its own layer and of two others. One rank.

#include <benchmark/benchmark.h>

#ifdef PELLICLE_BULLET
#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#endif
#ifdef PELLICLE_CGAL
#include <CGAL/box_intersection_d.h>
#endif

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "geometry/box_tree.h"
#include "geometry/pi.h"

namespace pellicle {
namespace {

using Boxes = std::vector<Eigen::AlignedBox3d>;

/// The boxes of the triangles of a square cloth of side 1, rolled up round an axis, and half a contact's thickness
/// wider on all sides.
Boxes rolled_cloth(int cells_a_side) {
  const double side = 1.0 / cells_a_side;
  const double rise = 0.5 * side / (2 * pi);  // of the radius with the angle
  const auto corner = [&](int i, int j) {
    // Archimedes' spiral from a radius of 0.02 on, whose length is about its mean radius times its angle.
    const double length = i * side;
    const double first = 0.02;
    const double angle = (std::sqrt(first * first + 2 * rise * length) - first) / rise;
    const double radius = first + rise * angle;
    return Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), j * side);
  };
  const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, 2, 3).normalized());  // Nothing lies along an axis.
  Boxes boxes;
  boxes.reserve(2 * static_cast<std::size_t>(cells_a_side) * static_cast<std::size_t>(cells_a_side));
  for (int i = 0; i < cells_a_side; ++i) {
    for (int j = 0; j < cells_a_side; ++j) {
      const std::array<Eigen::Vector3d, 4> corners{turn * corner(i, j), turn * corner(i + 1, j),
                                                   turn * corner(i + 1, j + 1), turn * corner(i, j + 1)};
      for (const auto& triangle : {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 3}}) {
        Eigen::AlignedBox3d& box = boxes.emplace_back();
        for (const std::size_t k : triangle) {
          box.extend(corners[k]);
        }
        box.min().array() -= 0.1 * side;
        box.max().array() += 0.1 * side;
      }
    }
  }
  return boxes;
}

void by_pellicle(benchmark::State& state, const Boxes& boxes) {
  double pairs = 0;
  for (auto _ : state) {
    pairs = 0;
    BoxTree({boxes.begin(), boxes.end()}).visit_pairs([&pairs](int, int) { ++pairs; });
  }
  state.counters["pairs"] = pairs;
}

#ifdef PELLICLE_BULLET
void by_bullet(benchmark::State& state, const Boxes& boxes) {
  struct Count : btDbvt::ICollide {
    double pairs = 0;
    void Process(const btDbvtNode* /*one*/, const btDbvtNode* /*other*/) override { ++pairs; }
  };
  Count count;
  const auto vector = [](const Eigen::Vector3d& x) {
    return btVector3(static_cast<btScalar>(x[0]), static_cast<btScalar>(x[1]), static_cast<btScalar>(x[2]));
  };
  for (auto _ : state) {
    count.pairs = 0;
    btDbvt tree;
    for (const Eigen::AlignedBox3d& box : boxes) {
      tree.insert(btDbvtVolume::FromMM(vector(box.min()), vector(box.max())), nullptr);
    }
    tree.optimizeTopDown();
    tree.collideTT(tree.m_root, tree.m_root, count);
  }
  state.counters["pairs"] = count.pairs;
}
#endif

#ifdef PELLICLE_CGAL
void by_cgal(benchmark::State& state, const Boxes& boxes) {
  using Box = CGAL::Box_intersection_d::Box_d<double, 3>;
  double pairs = 0;
  for (auto _ : state) {
    pairs = 0;
    std::vector<Box> copies;
    copies.reserve(boxes.size());
    for (Eigen::AlignedBox3d box : boxes) {
      copies.emplace_back(box.min().data(), box.max().data());
    }
    CGAL::box_self_intersection_d(copies.begin(), copies.end(), [&pairs](const Box&, const Box&) { ++pairs; });
  }
  state.counters["pairs"] = pairs;
}
#endif

[[maybe_unused]] const bool broad_phase_registered = [] {
  for (const int triangles : {10'000, 100'000, 1'000'000}) {
    const auto add = [triangles](const std::string& name, void (*run)(benchmark::State&, const Boxes&)) {
      benchmark::RegisterBenchmark(("broad_phase/" + name + "/" + std::to_string(triangles)).c_str(),
                                   [triangles, run](benchmark::State& state) {
                                     run(state, rolled_cloth(static_cast<int>(std::sqrt(triangles / 2))));
                                   })
          ->Unit(benchmark::kMillisecond);
    };
    add("pellicle", by_pellicle);
#ifdef PELLICLE_BULLET
    add("bullet", by_bullet);
#endif
#ifdef PELLICLE_CGAL
    add("cgal", by_cgal);
#endif
  }
  return true;
}();

}  // namespace
}  // namespace pellicle
