#include <gtest/gtest.h>

#include "base/error.h"
#include "heat/heat_balance.h"
#include "parallel/collective.h"
#include "tests/heat/sheets.h"

namespace pellicle {
namespace {

constexpr double capacity = 1340;

class HeatSources : public ::testing::Test {
 protected:
  HeatSources()
      : sheet_(shell_of(grid_mesh(10, 8, 0.1), 0.02)),
        positions_(rest_positions(sheet_)),
        mass_(initial_masses(sheet_)),
        temperature_(field_of(sheet_, [](const Eigen::Vector3d& x) { return 300 + 900 * x.x(); })) {}

  double apply(const HeatSource& source, double time, double step) {
    return sum_over_ranks(
        PETSC_COMM_WORLD,
        apply_heat_source(temperature_, source, {sheet_, positions_, mass_, texture_, time, step, capacity}));
  }

  Sheet sheet_;
  Field positions_;
  Field mass_;
  Field temperature_;
  std::vector<double> texture_;
};

TEST_F(HeatSources, ABallHeatsWhatIsNearItsCentreAtTheStartOfTheStep) {
  HeatSource source;
  source.centre = {0.2, 0.4, 0};
  source.velocity = {1.2, 0, 0};
  source.radius = 0.3;
  source.temperature = 1000;
  source.rate = 20;
  const Field before = field_of(sheet_, [](const Eigen::Vector3d& x) { return 300 + 900 * x.x(); });
  const double content = sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature_, capacity));
  const double heat = apply(source, 0.25, 0.01);
  int heated = 0;
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    const double r = (sheet_.rest.col(i) - Eigen::Vector3d(0.5, 0.4, 0)).norm() / 0.3;
    const double old = before.data()[i];
    const double rise = r < 1 ? (1 - std::exp(-0.2)) * std::pow(1 - r * r, 2) * std::max(1000 - old, 0.0) : 0;
    EXPECT_NEAR(temperature_.data()[i], old + rise, 1e-10);
    heated += rise > 0;
  }
  EXPECT_GT(sum_over_ranks(PETSC_COMM_WORLD, heated), 20);
  EXPECT_GT(heat, 0);
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature_, capacity)), content + heat,
              1e-12 * content);
}

TEST_F(HeatSources, ATextureHeatsByItsBrightnessWhateverTheStep) {
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    texture_.push_back(sheet_.rest(1, i) / 0.8);
  }
  HeatSource source;
  source.shape = "texture";
  source.temperature = 700;
  source.rate = 5;
  const double content = sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature_, capacity));
  const double heat = apply(source, 0, 0.1) + apply(source, 0.1, 0.3);
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    const double old = 300 + 900 * sheet_.rest(0, i);
    const double expected = old >= 700 ? old : 700 + (old - 700) * std::exp(-5 * 0.4 * sheet_.rest(1, i) / 0.8);
    EXPECT_NEAR(temperature_.data()[i], expected, 1e-10);
  }
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature_, capacity)), content + heat,
              1e-12 * content);
}

TEST_F(HeatSources, HeatOnlyBetweenStartAndEnd) {
  HeatSource source;
  source.centre = {0.5, 0.4, 0};
  source.start_time = 0.1;
  source.end_time = 0.2;
  EXPECT_EQ(apply(source, 0.099, 0.01), 0);
  EXPECT_GT(apply(source, 0.1, 0.01), 0);
  EXPECT_EQ(apply(source, 0.2, 0.01), 0);
}

TEST(HeatSource, FollowsItsKeyPoints) {
  HeatSource source;
  source.centre = {7, 7, 7};
  source.path = {{1, 0, 0, 0}, {2, 1, 2, 3}, {4, 1, 2, 5}};
  EXPECT_TRUE(source.centre_at(0).isApprox(Eigen::Vector3d(0, 0, 0)));
  EXPECT_TRUE(source.centre_at(1.5).isApprox(Eigen::Vector3d(0.5, 1, 1.5)));
  EXPECT_TRUE(source.centre_at(3).isApprox(Eigen::Vector3d(1, 2, 4)));
  EXPECT_TRUE(source.centre_at(9).isApprox(Eigen::Vector3d(1, 2, 5)));
}

TEST(HeatSource, RefusesATextureWithoutAFileAndAPathThatGoesBackInTime) {
  const auto message = [](const HeatSource& source) -> std::string {
    try {
      validate("lamp", source);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  };
  HeatSource texture;
  texture.shape = "texture";
  EXPECT_EQ(message(texture), "heat.sources.lamp.file: a source of shape texture needs an image");
  HeatSource ball;
  EXPECT_EQ(message(ball), "");
  ball.path = {{1, 0, 0, 0}, {0, 1, 2, 3}};
  EXPECT_EQ(message(ball).find("heat.sources.lamp.path: key point 2"), 0U) << message(ball);
}

}  // namespace
}  // namespace pellicle
