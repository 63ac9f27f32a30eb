#include "tests/support/sphere_formulas.h"

#include <gtest/gtest.h>

namespace pellicle {
namespace {

Material neo_hookean() { return {Choice<Material::Law>("neo_hookean"), 4e5, 0, 0, 0, {}, {}}; }
Material mooney_rivlin() { return {Choice<Material::Law>("mooney_rivlin"), 0, 0, 2e5, 2e4, {}, {}}; }
Material ogden() { return {Choice<Material::Law>("ogden"), 0, 0, 0, 0, {6.3e5, 1.2e3, -1e4}, {1.3, 5, -2}}; }
Material st_venant_kirchhoff() { return {Choice<Material::Law>("st_venant_kirchhoff"), 4e5, 6e5, 0, 0, {}, {}}; }

TEST(SphereFormulas, NeoHookeanLimitPoint) {
  const double stretch = extremal_stretch(neo_hookean(), 1.05, 3);
  EXPECT_NEAR(stretch, std::pow(7, 1.0 / 6), 1e-6);
  EXPECT_NEAR(stretch, 1.38309, 1e-5);
  EXPECT_NEAR(sphere_pressure(neo_hookean(), 1, stretch) / 4e5, 1.23946, 1e-5);
}

TEST(SphereFormulas, MooneyRivlinLimitPoints) {
  const double highest = extremal_stretch(mooney_rivlin(), 1.05, 2);
  EXPECT_NEAR(highest, 1.4761, 1e-4);
  EXPECT_NEAR(sphere_pressure(mooney_rivlin(), 1, highest) / 2e5, 2.98124, 1e-5);
  const double lowest = extremal_stretch(mooney_rivlin(), 2, 5);
  EXPECT_NEAR(lowest, 3.1427, 1e-4);
  EXPECT_NEAR(sphere_pressure(mooney_rivlin(), 1, lowest) / 2e5, 2.52724, 1e-5);
}

TEST(SphereFormulas, OgdenLimitPoints) {
  const double highest = extremal_stretch(ogden(), 1.05, 2);
  EXPECT_NEAR(highest, 1.3741, 1e-4);
  EXPECT_NEAR(sphere_pressure(ogden(), 1, highest), 5.4941e5, 10);
  const double lowest = extremal_stretch(ogden(), 2, 6);
  EXPECT_NEAR(lowest, 4.3203, 1e-4);
  EXPECT_NEAR(sphere_pressure(ogden(), 1, lowest), 2.3555e5, 10);
}

// The work p dV of the gas is what the wall takes up: p = (h/R) psi'(stretch) / stretch^2.
TEST(SphereFormulas, EnergyDensitiesGiveThePressure) {
  for (const Material& material : {neo_hookean(), mooney_rivlin(), ogden()}) {
    for (const double s : {1.1, 1.5, 2.0, 3.0}) {
      const EnergyDensity energy = energy_density(material, 2 * s * s, std::pow(s, 4), std::pow(s, -4));
      const double slope = energy.gradient[0] * 4 * s + energy.gradient[1] * 4 * std::pow(s, 3) -
                           energy.gradient[2] * 4 * std::pow(s, -5);
      const double pressure = sphere_pressure(material, 0.003, s);
      EXPECT_NEAR(0.003 * slope / (s * s), pressure, 1e-12 * pressure);
    }
  }
}

TEST(SphereFormulas, StVenantKirchhoffInPlaneStress) {
  const Material material = st_venant_kirchhoff();
  for (const double s : {1.02, 1.1, 1.2}) {
    const double t = 2 * s * s;
    const double c = 1 - material.lambda / (material.lambda + 2 * material.mu) * (t - 2);
    const EnergyDensity energy = energy_density(material, t, std::pow(s, 4), c);
    EXPECT_NEAR(energy.gradient[2], 0, 1e-9 * material.mu) << "no stress across the wall";
    const double slope = energy.gradient[0] * 4 * s + energy.gradient[1] * 4 * std::pow(s, 3);
    const double pressure = sphere_pressure(material, 0.003, s);
    EXPECT_NEAR(0.003 * slope / (s * s), pressure, 1e-12 * pressure);
  }
}

}  // namespace
}  // namespace pellicle
