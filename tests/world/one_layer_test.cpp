// A sheet of one layer: a net of blue springs.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/alone.h"
#include "tests/support/grid_mesh.h"

namespace pellicle::one_layer_test {
namespace {

struct Net : Alone {
  explicit Net(const Options& options) : Alone(grid_mesh(8, 6, 0.1), options) {}

  void go(int steps) {
    for (int step = 0; step < steps; ++step) {
      const AloneStep result = advance(2e-3);
      ASSERT_TRUE(result.converged) << "step " << step + 1 << ": " << result.reason;
    }
  }
};

Options net_options() {
  Options options;
  options.dynamics = Dynamics::projection;
  options.sheet.layers = 1;
  options.force.damping = 0;
  options.project.ksp_rtol = 1e-10;
  return options;
}

TEST(OneLayerNet, FallsFreely) {
  Net net(net_options());
  net.go(50);
  for (PetscInt i = 0; i < net.sheet().particles.local(); ++i) {
    EXPECT_LE((net.state().velocity.vector(i) - Eigen::Vector3d(0, 0, -0.981)).norm(), 1e-9);
  }
}

TEST(OneLayerNet, DoesNotResistShear) {
  // The lower side is constrained, the upper one is led along it: the cells become rhombs of the same sides.
  Options options = net_options();
  options.force.gravity.setZero();
  options.pins["below"].box = {-1, -0.01, -1, 2, 0.01, 1};
  options.pins["above"].box = {-1, 0.59, -1, 2, 0.61, 1};
  const double angle = 0.5;
  for (int k = 0; k <= 50; ++k) {
    const double a = angle * k / 50;
    options.pins["above"].path.push_back({0.002 * k, 0.6 * std::sin(a), 0.6 * (std::cos(a) - 1), 0});
  }
  Net net(options);
  net.go(50);
  const WeaveStrain strain = *net.object.last_step().strain;
  EXPECT_LE(strain.largest, 0.01);
  EXPECT_EQ(strain.largest_of[static_cast<std::size_t>(Colour::yellow)], 0) << "does not act";
  for (std::size_t cell = 0; cell < net.sheet().cells.size(); ++cell) {
    const auto& [a, b, c, d] = net.sheet().cells[cell];
    const Field& x = net.state().position;
    const double diagonal = (x.vector(a) - x.vector(c)).norm();
    EXPECT_NEAR(diagonal, 0.2 * std::cos(M_PI / 4 - angle / 2), 5e-3);
    EXPECT_LE(
        (x.vector(net.sheet().lattice[cell]) - (x.vector(a) + x.vector(b) + x.vector(c) + x.vector(d)) / 4).norm(),
        1e-14);
  }
}

// The pressure on what is drawn at the cells' centres pushes these in two layers, and the corners in one.
TEST(OneLayerNet, IsPushedByGasAsMuchAsASheetOfTwoLayers) {
  for (const int layers : {1, 2}) {
    Options options = net_options();
    options.sheet.layers = layers;
    options.force.gravity.setZero();
    options.chambers["below"].law = "pressure";
    options.chambers["below"].pressure = {{0, 10}};
    Net net(options);
    net.go(1);
    const double area = 8 * 6 * 0.1 * 0.1;
    EXPECT_NEAR(net.momentum().norm(), 10 * area * 2e-3, 1e-9) << layers;
  }
}

TEST(OneLayerNet, HasNoHookeSprings) {
  ObjectOptions object("");
  object.options.dynamics = Dynamics::spring;
  EXPECT_NE(object.table.find_key("sheet.layers")->idle_because(), nullptr);
}

}  // namespace
}  // namespace pellicle::one_layer_test
