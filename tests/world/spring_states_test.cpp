#include <gtest/gtest.h>

#include "ablation/ablation.h"
#include "combustion/combustion.h"
#include "geometry/marching_triangle.h"

namespace pellicle::spring_states_test {
namespace {

// Fig. 5 of the burning paper: five springs by the masses of their ends, with m^loss = 0.5 and a density that does not
// change: lengths of 87.5, 62.5, 57.5 and 50 % of the initial one; two are whole, two partly burnt, one is burnt.
TEST(SpringStates, Figure5) {
  constexpr double loss_mass = 0.5;
  CombustionOptions options;
  options.min_mass = 0.25;
  options.burnt_density = options.initial_density;
  struct Case {
    double mass_0, mass_1, length;
    SpringState state;
  };
  for (const Case& c : {Case{1, 0.75, 0.875, SpringState::shrunk}, Case{0.75, 0.5, 0.625, SpringState::shrunk},
                        Case{0.75, 0.4, 0.575, SpringState::partly_burnt},
                        Case{0.6, 0.4, 0.5, SpringState::partly_burnt}, Case{0.4, 0.25, 0.325, SpringState::burnt}}) {
    EXPECT_NEAR((volume_ratio(c.mass_0, options) + volume_ratio(c.mass_1, options)) / 2, c.length, 1e-15);
    EXPECT_EQ(spring_state(c.mass_0 - loss_mass, c.mass_1 - loss_mass), c.state) << c.length;
    EXPECT_EQ(spring_state(c.mass_1 - loss_mass, c.mass_0 - loss_mass), c.state) << c.length;
  }
}

// Eq. 7: x_mid lies at t = m'_0 / (m'_0 - m'_1) of the way from the end that is left.
TEST(SpringStates, APartlyBurntSpringIsCutInProportion) {
  const KeptPart part = marching_triangle({0.25, -0.1, -0.3});
  ASSERT_EQ(part.count, 1);
  double t_to_1 = 0;
  double t_to_2 = 0;
  for (const BorderPoint& point : part.triangles[0]) {
    t_to_1 = point.to == 1 ? point.t : t_to_1;
    t_to_2 = point.to == 2 ? point.t : t_to_2;
  }
  EXPECT_NEAR(t_to_1, 0.25 / 0.35, 1e-15);
  EXPECT_NEAR(t_to_2, 0.25 / 0.55, 1e-15);
}

}  // namespace
}  // namespace pellicle::spring_states_test
