#include "contact/contact_laws.h"

#include <gtest/gtest.h>

namespace pellicle::contact_laws_test {
namespace {

const Barrier of_a_surface{3, 0.02, 1, 0.1};
const Barrier of_a_body{3, 0.02, 0.05, 0};

TEST(Barrier, SlopeAndCurvatureAreDerivatives) {
  for (const Barrier& barrier : {of_a_surface, of_a_body}) {
    for (const double gap : {1e-5, 1e-3, 1.9e-3, 2.1e-3, 0.012, 0.0195, 0.021}) {
      const double h = 1e-4 * gap;
      const double slope = (barrier.value(gap + h) - barrier.value(gap - h)) / (2 * h);
      const double curvature = (barrier.slope(gap + h) - barrier.slope(gap - h)) / (2 * h);
      EXPECT_NEAR(barrier.slope(gap), slope, 1e-6 * barrier.stiffness * barrier.thickness) << gap;
      EXPECT_NEAR(barrier.curvature(gap), curvature, 1e-6 * (barrier.stiffness + barrier.curvature(gap))) << gap;
    }
  }
}

TEST(Barrier, SurfacesBearAnyForceBeforeTheyMeetAndBodiesPressOnWhatIsInside) {
  const double spring = of_a_surface.stiffness * of_a_surface.thickness / 2;  // all that the cubic part bears
  EXPECT_LT(-of_a_surface.slope(0.002), spring);
  EXPECT_GT(-of_a_surface.slope(2e-5), 10 * spring);
  EXPECT_GT(-of_a_surface.slope(2e-7), 1000 * spring);
  EXPECT_NEAR(of_a_body.slope(-0.01) - of_a_body.slope(0), -of_a_body.stiffness * 0.01, 1e-15);
}

TEST(Barrier, NothingPressesFromTheThicknessOn) {
  for (const Barrier& barrier : {of_a_surface, of_a_body}) {
    EXPECT_EQ(barrier.value(0.02), 0);
    EXPECT_EQ(barrier.slope(0.021), 0);
    EXPECT_EQ(barrier.curvature(0.03), 0);
  }
}

}  // namespace
}  // namespace pellicle::contact_laws_test
