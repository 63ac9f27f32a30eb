// Spheres blown up without inertia, against the formulas for thin spherical balloons: p(stretch).

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include "meshing/closed_shapes.h"
#include "tests/support/print_once.h"
#include "tests/support/solver_options.h"
#include "tests/support/sphere_formulas.h"
#include "tests/world/static_balloon.h"

namespace pellicle::sphere_inflation_test {
namespace {

constexpr double radius = 0.1;      // R [m]
constexpr double thickness = 3e-4;  // h [m]

/// An icosphere whose gas is blown up to given stretches, one a second.
Options options_for(const std::string& law, const std::vector<double>& stretches) {
  Options options = static_options();
  options.wall.thickness = thickness;
  options.wall.material.law = law;
  if (law == "st_venant_kirchhoff") {
    // More of Poisson's ratio, and no thickness could balance a stretch of 3: E_zz = -nu/(1 - nu) tr E > -1/2.
    options.wall.material.young_modulus = 1e6;
    options.wall.material.poisson_ratio = 0.05;
    options.wall.thickness_rule = "plane_stress";
  }
  ChamberOptions& gas = options.chambers["gas"];
  gas.law = "volume";
  gas.volume_ratio = {{0, 1}};
  for (const double stretch : stretches) {
    gas.volume_ratio.push_back({static_cast<double>(gas.volume_ratio.size()), std::pow(stretch, 3)});
  }
  return options;
}

/// The pressures at these stretches.
std::vector<double> pressures(int level, const Options& options, std::size_t count, Material* material) {
  StaticBalloon balloon(icosphere_mesh(level, radius), options);
  *material = balloon.elements().wall().materials[0];
  std::vector<double> result;
  for (std::size_t i = 1; i <= count; ++i) {
    balloon.reach(static_cast<double>(i));
    result.push_back(balloon.pressure());
    if (options.wall.thickness_rule !=
        WallThickness::global_volume) {  // Its volume preservation moves the wall afterwards.
      const double ratio = options.chambers.at("gas").volume_ratio.at(i).at(1);
      EXPECT_NEAR(balloon.volume() / balloon.chambers().initial_volume(0), ratio, 1e-7 * ratio);
    }
  }
  print_once("  level %d: %d Newton and %d linear iterations for %d steps\n", level, balloon.newton_iterations,
             balloon.linear_iterations, static_cast<int>(count));
  return result;
}

class SphereInflation : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Laws, SphereInflation,
                         ::testing::Values("neo_hookean", "mooney_rivlin", "ogden", "st_venant_kirchhoff"),
                         [](const auto& law) { return law.param; });

TEST_P(SphereInflation, PressureIsTheFormulasToSecondOrder) {
  const std::vector<double> stretches{1.1, 1.3, 1.5, 2, 2.5, 3};
  // 162, 642, 2562 and, on one rank, 10,242 vertices.
  const std::vector<int> levels = ranks() == 1 ? std::vector<int>{2, 3, 4, 5} : std::vector<int>{2, 3};
  double coarser = 0;
  for (const int level : levels) {
    Material material;
    const std::vector<double> found = pressures(level, options_for(GetParam(), stretches), stretches.size(), &material);
    double worst = 0;
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      const double expected = sphere_pressure(material, thickness / radius, stretches[i]);
      worst = std::max(worst, std::abs(found[i] / expected - 1));
    }
    print_once("%s, level %d: pressure to %.2e\n", GetParam().c_str(), level, worst);
    EXPECT_LT(worst, 0.017 * std::pow(4.0, 2 - level)) << level;
    if (coarser > 0) {
      EXPECT_NEAR(coarser / worst, 4, 0.1) << level;
    }
    coarser = worst;
  }
}

// The sphere grows evenly, the pressure starts as the forces leave it, and the volume takes no solve of its own.
TEST(SphereSweep, TakesAnIterationAStep) {
  constexpr int steps = 12;
  std::vector<double> stretches;
  for (int i = 1; i <= steps; ++i) {
    stretches.push_back(1 + i / static_cast<double>(steps));
  }
  StaticBalloon balloon(icosphere_mesh(ranks() == 1 ? 4 : 3, radius), options_for("neo_hookean", stretches));
  for (int i = 1; i <= 3; ++i) {
    balloon.reach(i);
  }
  const int newton_before = balloon.newton_iterations;
  const int linear_before = balloon.linear_iterations;
  for (int i = 4; i <= steps; ++i) {
    balloon.reach(i);
  }
  print_once("%d Newton and %d linear iterations for %d steps\n", balloon.newton_iterations - newton_before,
             balloon.linear_iterations - linear_before, steps - 3);
  EXPECT_LE(balloon.newton_iterations - newton_before, steps - 3);
}

/// A limit point: the highest or lowest pressure between two stretches.
struct Limit {
  std::string law;
  double from;
  double to;
  bool is_maximum;
  friend std::ostream& operator<<(std::ostream& stream, const Limit& limit) { return stream << limit.law; }
};

class LimitPoint : public ::testing::TestWithParam<Limit> {};
INSTANTIATE_TEST_SUITE_P(Laws, LimitPoint,
                         ::testing::Values(Limit{"neo_hookean", 1.3, 1.5, true}, Limit{"mooney_rivlin", 1.4, 1.6, true},
                                           Limit{"mooney_rivlin", 3.0, 3.3, false}, Limit{"ogden", 1.3, 1.5, true},
                                           Limit{"ogden", 4.1, 4.5, false}),
                         [](const auto& limit) {
                           return limit.param.law + (limit.param.is_maximum ? "_highest" : "_lowest");
                         });

TEST_P(LimitPoint, IsFoundByASweepOfVolumes) {
  const Limit& limit = GetParam();
  std::vector<double> stretches{1.1};
  while (stretches.back() + 0.3 < limit.from) {
    stretches.push_back(stretches.back() + 0.3);
  }
  const std::size_t first = stretches.size();
  constexpr int points = 21;
  for (int i = 0; i < points; ++i) {
    stretches.push_back(limit.from + (limit.to - limit.from) * i / (points - 1));
  }
  Material material;
  const std::vector<double> found =
      pressures(ranks() == 1 ? 3 : 2, options_for(limit.law, stretches), stretches.size(), &material);
  const auto begin = found.begin() + static_cast<std::ptrdiff_t>(first);
  const auto extreme = limit.is_maximum ? std::max_element(begin, found.end()) : std::min_element(begin, found.end());
  const double stretch = stretches[extreme - found.begin()];
  const double expected_stretch = extremal_stretch(material, limit.from, limit.to);
  const double expected = sphere_pressure(material, thickness / radius, expected_stretch);
  print_once("%s: stretch %.4f (%.4f), pressure %.2f Pa (%.2f): %.2e\n", limit.law.c_str(), stretch, expected_stretch,
             *extreme, expected, *extreme / expected - 1);
  EXPECT_NEAR(stretch, expected_stretch, (limit.to - limit.from) / (points - 1));
  EXPECT_NEAR(*extreme, expected, (ranks() == 1 ? 0.005 : 0.02) * expected);
}

/// Pressure of a sphere by an energy per undeformed volume: p = (h/R) psi'(stretch) / stretch^2. [Pa]
/// @param ratio h/h0 as a function of the stretch
template <class Ratio>
double pressure_by_energy(const Material& material, double stretch, const Ratio& ratio) {
  const auto psi = [&](double s) {
    return energy_density(material, 2 * s * s, std::pow(s, 4), std::pow(ratio(s), 2)).value;
  };
  constexpr double step = 1e-5;
  return thickness / radius * (psi(stretch + step) - psi(stretch - step)) / (2 * step) / (stretch * stretch);
}

/// h/h0 without stress across the wall.
double unstressed_ratio(const Material& material, double stretch) {
  double low = 1e-3;
  double high = 1;
  for (int i = 0; i < 100; ++i) {
    const double middle = (low + high) / 2;
    const EnergyDensity psi =
        energy_density(material, 2 * stretch * stretch, std::pow(stretch, 4), std::pow(middle, 2));
    (psi.gradient[2] < 0 ? low : high) = middle;
  }
  return low;
}

TEST(ThicknessRules, DifferAsTheirEnergiesDo) {
  constexpr double stretch = 1.4;
  // The paper's thickness follows the wall from step to step: several at the same volume.
  Options options = options_for("neo_hookean", {1.1, 1.2, 1.3, stretch, stretch, stretch, stretch, stretch});
  options.wall.material.lambda = 4e5;
  const auto pressure_of = [&](const std::string& rule, Material* material) {
    options.wall.thickness_rule = rule;
    return pressures(3, options, 8, material).back();
  };
  Material material;
  const double fixed = pressure_of("fixed", &material);
  const double incompressible = pressure_of("incompressible", &material);
  const double plane_stress = pressure_of("plane_stress", &material);
  const double global = pressure_of("global", &material);
  const double expected_fixed = pressure_by_energy(material, stretch, [](double) { return 1.0; });
  const double expected_incompressible = pressure_by_energy(material, stretch, [](double s) { return 1 / (s * s); });
  const double expected_plane_stress =
      pressure_by_energy(material, stretch, [&](double s) { return unstressed_ratio(material, s); });
  const double expected_global = pressure_by_energy(material, stretch, [&](double) { return 1 / (stretch * stretch); });
  print_once("fixed %.1f (%.1f), incompressible %.1f (%.1f), plane stress %.1f (%.1f), global %.1f (%.1f) Pa\n", fixed,
             expected_fixed, incompressible, expected_incompressible, plane_stress, expected_plane_stress, global,
             expected_global);
  EXPECT_NEAR(fixed, expected_fixed, 5e-3 * fixed);
  EXPECT_NEAR(incompressible, expected_incompressible, 5e-3 * incompressible);
  EXPECT_NEAR(plane_stress, expected_plane_stress, 5e-3 * plane_stress);
  EXPECT_NEAR(global, expected_global, 5e-3 * global);
}

TEST(ThicknessRules, PlaneStressTendsToIncompressible) {
  Options options = options_for("mooney_rivlin", {1.2, 1.6});
  Material material;
  const double incompressible = pressures(2, options, 2, &material).back();
  options.wall.thickness_rule = "plane_stress";
  double softer = 0;
  for (const double lambda : {1e7, 1e8, 1e9}) {
    options.wall.material.lambda = lambda;
    const double difference = std::abs(pressures(2, options, 2, &material).back() / incompressible - 1);
    print_once("lambda %.0e Pa: %.2e\n", lambda, difference);
    if (softer > 0) {
      EXPECT_NEAR(softer / difference, 10, 1);
    }
    softer = difference;
  }
  EXPECT_LT(softer, 1e-3);
}

}  // namespace
}  // namespace pellicle::sphere_inflation_test
