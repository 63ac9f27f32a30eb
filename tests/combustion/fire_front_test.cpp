#include <gtest/gtest.h>

#include <tuple>

#include "combustion/combustion.h"

namespace pellicle {
namespace {

/// The strip of docs/fire.md.
CombustionOptions of_strip() {
  CombustionOptions options;
  options.ignition_temperature = 500;
  options.mass_loss_rate = 0.015;
  options.min_mass = 0.3;
  return options;
}

TEST(FireFront, GoesAsFastAsMeasuredFrontsButForAFifth) {
  const CombustionOptions options = of_strip();
  for (const auto& [diffusivity, heat, measured] :
       {std::tuple(1e-3, 900.0, 0.062), std::tuple(1e-3, 1200.0, 0.092), std::tuple(1e-3, 1500.0, 0.121),
        std::tuple(2.5e-4, 1200.0, 0.045), std::tuple(4e-3, 1200.0, 0.2)}) {
    const std::optional<FireFront> front = fire_front({diffusivity, heat, 300, 0.4}, options);
    ASSERT_TRUE(front);
    EXPECT_GT(front->speed, 0.8 * measured) << heat;
    EXPECT_LT(front->speed, measured) << heat;
    EXPECT_NEAR(front->width, diffusivity / front->speed, 1e-15);
  }
}

TEST(FireFront, NoneGoesOnWithLessHeatThanIgnitionTakes) {
  EXPECT_FALSE(fire_front({1e-3, 470, 300, 0.4}, of_strip()));
  EXPECT_TRUE(fire_front({1e-3, 480, 300, 0.4}, of_strip()));
  EXPECT_FALSE(fire_front({0, 1200, 300, 0.4}, of_strip()));
  EXPECT_FALSE(fire_front({1e-3, 1200, 600, 0.4}, of_strip())) << "it burns everywhere";
}

}  // namespace
}  // namespace pellicle
