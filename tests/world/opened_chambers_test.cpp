// A chamber that opens for good is announced once, also when the run goes on from a checkpoint.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "meshing/triangulation.h"
#include "state/hdf5_file.h"
#include "surface/mesh_rows.h"
#include "tests/io/files.h"
#include "tests/support/grid_mesh.h"
#include "world/world.h"

namespace pellicle::opened_chambers_test {
namespace {

/// A vault of a sheet or a wall, whose rim is a hole through which its gas may flow out.
class OpenedChambers : public ::testing::TestWithParam<ChainKind> {
 protected:
  static Options vault_options() {
    Options options;
    options.chain = GetParam();
    options.dynamics = Dynamics::projection;
    options.force.gravity.setZero();
    ChamberOptions& gas = options.chambers["gas"];
    gas.law = GasLaw::isothermal;
    gas.hole_discharge = 0.6;
    return options;
  }
  static SurfaceMesh vault() {
    SurfaceMesh mesh = grid_mesh(4, 4, 0.05);
    for (Eigen::Vector3d& point : mesh.points) {
      point.z() = 0.1 * std::sin(M_PI * point.x() / 0.2) * std::sin(M_PI * point.y() / 0.2);
    }
    return GetParam() == ChainKind::inflate ? triangulated(mesh) : mesh;
  }

  World world_of(std::unique_ptr<Object> object) const {
    std::vector<std::unique_ptr<Object>> objects;
    objects.push_back(std::move(object));
    return {std::move(objects), {plan_of(options_)}};
  }
  void save(const World& world, const std::string& name) const {
    Hdf5File file(PETSC_COMM_WORLD, folder_ / name, Hdf5File::Mode::create);
    world.save(file);
    file.close();
  }
  World restarted(const std::string& name) const {
    const Hdf5File file(PETSC_COMM_WORLD, folder_ / name, Hdf5File::Mode::read);
    return world_of(std::make_unique<Object>("", options_, file));
  }
  /// How often it is announced in two steps that the chamber has opened.
  static int announced_in_two_steps(World& world) {
    int count = 0;
    for (int n = 0; n < 2; ++n) {
      const StepResult result = world.step(1e-3);
      EXPECT_TRUE(result.converged) << result.reason;
      for (const News& news : world.objects().front()->take_news()) {
        count += news.line.find("is open for good") != std::string::npos ? 1 : 0;
      }
    }
    return count;
  }

  TestFolder folder_;
  Options options_ = vault_options();
};

INSTANTIATE_TEST_SUITE_P(Chains, OpenedChambers, ::testing::Values(ChainKind::burn, ChainKind::inflate),
                         [](const auto& info) { return Choice<ChainKind>(info.param).name(); });

TEST_P(OpenedChambers, AreNotAnnouncedAgainAfterARestart) {
  World world = world_of(std::make_unique<Object>("", options_, PETSC_COMM_WORLD, rows_of(PETSC_COMM_WORLD, vault())));
  const State& state = world.objects().front()->state();
  ASSERT_NE(state.gas, nullptr);
  EXPECT_FALSE(state.gas->is_open(0));
  save(world, "closed.h5");
  EXPECT_EQ(announced_in_two_steps(world), 1);
  EXPECT_TRUE(state.gas->is_open(0));
  save(world, "open.h5");

  World opened = restarted("open.h5");
  EXPECT_TRUE(opened.objects().front()->state().gas->is_open(0));
  EXPECT_EQ(announced_in_two_steps(opened), 0) << "it was announced before the checkpoint";
  World closed = restarted("closed.h5");
  EXPECT_EQ(announced_in_two_steps(closed), 1) << "it opens after the checkpoint";
}

}  // namespace
}  // namespace pellicle::opened_chambers_test
