#include "gas/gas_network.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"

namespace pellicle {
namespace {

constexpr double ambient_pressure = 101325;     // [Pa]
constexpr double ambient_temperature = 293.15;  // [K]
constexpr double volume = 2e-3;                 // [m^3]
constexpr double molar_mass = 0.0289647;        // [kg/mol]
constexpr double g = 1.4;

GasNetwork::Link hole(double area, double discharge = 1) {
  GasNetwork::Link link;
  link.name = "hole";
  link.from = 0;
  link.options.area = area;
  link.options.discharge = discharge;
  return link;
}

/// A vessel at a pressure and a temperature, in its reference volume.
VesselGas gas_at(double pressure, double temperature) {
  const double amount = pressure * volume / (gas_constant * temperature);
  return {amount, amount * temperature};
}

GasNetwork::Step step_of(std::vector<VesselGas> gas, double h) {
  GasNetwork::Step step;
  const auto count = static_cast<Eigen::Index>(gas.size());
  step.gas = std::move(gas);
  step.volume = Eigen::VectorXd::Constant(count, volume);
  step.start_volume = step.volume;
  step.temperature = Eigen::VectorXd::Constant(count, ambient_temperature);
  step.h = h;
  return step;
}

GasNetwork::Vessel vessel(bool keeps_temperature) { return {keeps_temperature, g, volume}; }

/// Pressure of a vessel of one temperature whose gas leaves by a hole, at the end of `steps` steps [Pa].
double isothermal_pressure(double start, double area, double end, int steps, const GasOptions& options) {
  const GasNetwork network({vessel(true)}, {hole(area)}, options);
  std::vector<VesselGas> gas{gas_at(start, ambient_temperature)};
  double pressure = start;
  for (int i = 0; i < steps; ++i) {
    const GasNetwork::End ended = network.solve(step_of(gas, end / steps));
    EXPECT_TRUE(ended.converged);
    gas = ended.gas;
    pressure = ended.pressure[0];
  }
  return pressure;
}

TEST(GasNetwork, AChokedVesselEmptiesAsTheClosedFormulaSays) {
  // Into a vacuum the flow is in proportion to the pressure: p = p0 exp(-t/tau) where the temperature is kept.
  GasOptions options;
  options.ambient_pressure = 0;
  const double area = 1e-6;
  const double sound = std::sqrt(gas_constant * ambient_temperature / molar_mass);
  const double tau = volume / (area * sound * std::sqrt(g) * std::pow(2 / (g + 1), (g + 1) / (2 * (g - 1))));
  const auto error = [&](int steps) {
    return isothermal_pressure(5e5, area, tau, steps, options) / (5e5 * std::exp(-1.0)) - 1;
  };
  EXPECT_NEAR(error(400), 0, 2e-3);
  EXPECT_NEAR(error(200) / error(400), 2, 0.05);  // first order
}

TEST(GasNetwork, AChokedVesselWithoutHeatEmptiesAsTheClosedFormulaSays) {
  // p/p0 = (1 + (g - 1)/2 t/tau)^(-2 g/(g - 1)), and p falls with T^(g/(g - 1)).
  GasOptions options;
  options.ambient_pressure = 0;
  const double area = 1e-6;
  const double sound = std::sqrt(gas_constant * ambient_temperature / molar_mass);
  const double tau = volume / (area * sound * std::sqrt(g) * std::pow(2 / (g + 1), (g + 1) / (2 * (g - 1))));
  const auto errors = [&](int steps) {
    const GasNetwork network({vessel(false)}, {hole(area)}, options);
    std::vector<VesselGas> gas{gas_at(5e5, ambient_temperature)};
    GasNetwork::End ended;
    for (int i = 0; i < steps; ++i) {
      ended = network.solve(step_of(gas, tau / steps));
      EXPECT_TRUE(ended.converged);
      gas = ended.gas;
    }
    const double pressure = 5e5 * std::pow(1 + (g - 1) / 2, -2 * g / (g - 1));
    const double temperature = ambient_temperature * std::pow(1 + (g - 1) / 2, -2);
    return Eigen::Vector2d(ended.pressure[0] / pressure - 1, ended.temperature[0] / temperature - 1);
  };
  const Eigen::Vector2d coarse = errors(400);
  const Eigen::Vector2d fine = errors(800);
  EXPECT_LT(fine.cwiseAbs().maxCoeff(), 2e-3);
  EXPECT_NEAR(coarse[0] / fine[0], 2, 0.1);
  EXPECT_NEAR(coarse[1] / fine[1], 2, 0.1);
}

TEST(GasNetwork, SmallDifferencesOfPressureFlowByBernoulli) {
  // dp = p - p_amb falls as (sqrt(dp0) - k t)^2 with k = A sqrt(2/rho) p/(2 V), all but exact for a drop of 1e-3.
  const GasOptions options;
  const double start = 100;  // [Pa]
  const double area = 1e-7;
  const double density = ambient_pressure * molar_mass / (gas_constant * ambient_temperature);
  const double k = area * std::sqrt(2 / density) * ambient_pressure / (2 * volume);
  const double end = 0.7 * std::sqrt(start) / k;
  const double pressure = isothermal_pressure(ambient_pressure + start, area, end, 2000, options) - ambient_pressure;
  EXPECT_NEAR(pressure / (start * 0.09), 1, 6e-3);
}

TEST(GasNetwork, AVesselFillsToGammaTimesTheTemperatureOutside) {
  // What flows into a vacuum is as warm as gamma T outside, however long the step and wide the valve.
  GasOptions options;
  const GasNetwork network({vessel(false)}, {hole(1e-2)}, options);
  const GasNetwork::End ended = network.solve(step_of({gas_at(1e-3, ambient_temperature)}, 10));
  ASSERT_TRUE(ended.converged);
  EXPECT_NEAR(ended.pressure[0] / ambient_pressure, 1, 1e-6);
  EXPECT_NEAR(ended.temperature[0] / (g * ambient_temperature), 1, 1e-6);
}

TEST(GasNetwork, AStepDoesNotPassTheEquilibriumHoweverWideTheLink) {
  const GasOptions options;
  GasNetwork::Link tube = hole(1);
  tube.to = 1;
  const GasNetwork network({vessel(false), vessel(false)}, {tube}, options);
  const std::vector<VesselGas> gas{gas_at(3e5, 400), gas_at(1e5, 250)};
  for (const double h : {1e-6, 1e-3, 1.0, 1e3}) {
    const GasNetwork::End ended = network.solve(step_of(gas, h));
    ASSERT_TRUE(ended.converged) << h;
    EXPECT_GE(ended.pressure[0], ended.pressure[1] * (1 - 1e-9)) << h;
    EXPECT_NEAR((ended.gas[0].amount + ended.gas[1].amount) / (gas[0].amount + gas[1].amount), 1, 1e-12) << h;
    EXPECT_NEAR((ended.gas[0].heat + ended.gas[1].heat) / (gas[0].heat + gas[1].heat), 1, 1e-12) << h;
  }
}

TEST(GasNetwork, AStepEndsHoweverNearThePressuresAndWideTheLink) {
  // The flow goes with the square root of the difference, so that Newton's method may go to and fro between two signs.
  const GasNetwork::Link between = [] {
    GasNetwork::Link link = hole(1);
    link.to = 1;
    return link;
  }();
  int failures = 0;
  for (double area = 1e-8; area < 2; area *= 10) {
    for (double difference = 1e-6; difference < 2e5; difference *= 3) {
      for (const double h : {1e-6, 1e-3, 1.0}) {
        for (const double temperature : {250.0, 293.15, 600.0}) {
          GasNetwork::Link link = between;
          link.options.area = area;
          const GasNetwork network({vessel(false), vessel(false)}, {link}, GasOptions());
          const std::vector<VesselGas> gas{gas_at(ambient_pressure + difference, temperature),
                                           gas_at(ambient_pressure, ambient_temperature)};
          const GasNetwork::End end = network.solve(step_of(gas, h));
          const double left = end.converged ? end.pressure[0] - end.pressure[1] : -1e9;
          failures += end.converged && left > -1e-7 && left < difference * (1 + 1e-9) + 1e-7 ? 0 : 1;
        }
      }
    }
  }
  EXPECT_EQ(failures, 0);
}

TEST(GasNetwork, ValvesAndPumps) {
  const GasOptions options;
  GasNetwork::Link valve = hole(1e-4);
  valve.options.one_way = true;
  GasNetwork::Link pump;
  pump.name = "pump";
  pump.to = 1;
  pump.options.flow = {{0, 2e-3}};
  pump.options.temperature = 600;
  GasNetwork::Link closed = hole(1e-4);
  closed.options.opens = {{1, 0}, {2, 1}};
  const GasNetwork network({vessel(false), vessel(false)}, {valve, pump, closed}, options);
  const GasNetwork::End ended = network.solve(step_of({gas_at(5e4, 300), gas_at(1e5, 300)}, 0.5));
  ASSERT_TRUE(ended.converged);
  EXPECT_EQ(ended.flow[0], 0);  // The valve does not let the air in,
  EXPECT_EQ(ended.flow[2], 0);  // and the hole opens later.
  EXPECT_NEAR(ended.flow[1], 1e-3, 1e-15);
  EXPECT_NEAR(ended.gas[1].heat - gas_at(1e5, 300).heat, 1e-3 * g * 600, 1e-12);
}

TEST(GasNetwork, HeatOfTheWallComesToTheGas) {
  const GasOptions options;
  const GasNetwork network({vessel(false)}, {}, options);
  GasNetwork::Step step = step_of({gas_at(1e5, 300)}, 0.1);
  step.conductance = Eigen::VectorXd::Constant(1, 2);
  step.wall_temperature = Eigen::VectorXd::Constant(1, 500);
  const GasNetwork::End ended = network.solve(step);
  ASSERT_TRUE(ended.converged);
  const double amount = step.gas[0].amount;
  const double capacity = amount * gas_constant / (g - 1);
  EXPECT_NEAR(ended.temperature[0], (capacity * 300 + 0.1 * 2 * 500) / (capacity + 0.1 * 2), 1e-9);
  EXPECT_NEAR(capacity * (ended.temperature[0] - 300), ended.wall_heat[0], 1e-9);
}

/// Relative error of the pressure in a vessel that grows evenly by a half while gas is pumped in evenly.
double error_of_pumped_vessel(int steps) {
  GasOptions options;
  GasNetwork::Link pump = hole(0);
  pump.from = GasNetwork::ambient;
  pump.to = 0;
  pump.options = LinkOptions();
  pump.options.flow = {{0, 0.05}, {1, 0.05}};
  pump.options.temperature = 350;
  const GasNetwork network({vessel(false)}, {pump}, options);
  std::vector<VesselGas> gas{gas_at(1e5, 300)};
  double pressure = 0;
  for (int n = 0; n < steps; ++n) {
    GasNetwork::Step step = step_of(gas, 1.0 / steps);
    step.start_volume[0] = volume * (1 + 0.5 * n / steps);
    step.volume[0] = volume * (1 + 0.5 * (n + 1) / steps);
    step.time = static_cast<double>(n + 1) / steps;
    const GasNetwork::End ended = network.solve(step);
    EXPECT_TRUE(ended.converged);
    gas = ended.gas;
    pressure = ended.pressure[0];
  }
  // d(p V)/(g - 1) = -p dV + H dt, so that d(p V^g) = (g - 1) H V^(g - 1) dt with dV = a dt.
  const double power = 0.05 * gas_constant * g / (g - 1) * 350;
  const double growth = volume / 2;
  const double last = 1.5 * volume;
  const double exact =
      (1e5 * std::pow(volume, g) + (g - 1) * power * (std::pow(last, g) - std::pow(volume, g)) / (g * growth)) /
      std::pow(last, g);
  return pressure / exact - 1;
}

TEST(GasNetwork, WorkOfGasThatComesInWhileItsVesselGrowsIsOfSecondOrder) {
  const double coarse = error_of_pumped_vessel(10);
  const double fine = error_of_pumped_vessel(20);
  EXPECT_LT(std::abs(coarse), 1e-3);
  EXPECT_NEAR(coarse / fine, 4, 0.3);
}

TEST(GasNetwork, SlopesAreDerivativesOfThePressuresByTheVolumes) {
  const GasOptions options;
  GasNetwork::Link tube = hole(2e-5);
  tube.to = 1;
  GasNetwork::Link vent = hole(1e-5, 0.6);
  vent.from = 1;
  GasNetwork::Link other = hole(3e-6);
  other.from = 2;
  other.to = 1;
  const GasNetwork network({vessel(false), vessel(true), vessel(false)}, {tube, vent, other}, options);
  GasNetwork::Step step = step_of({gas_at(1.3e5, 320), gas_at(1.1e5, ambient_temperature), gas_at(2.5e5, 280)}, 5e-3);
  step.volume = Eigen::Vector3d(0.9, 1.1, 1.05) * volume;
  step.start_volume = Eigen::Vector3d(1, 0.95, 1.2) * volume;
  step.conductance = Eigen::Vector3d(1, 0, 3);
  step.wall_temperature = Eigen::Vector3d(400, 300, 350);
  step.leaks = {{0, 1e-6, 0}, {2, 2e-6, 500}};
  const GasNetwork::End ended = network.solve(step);
  ASSERT_TRUE(ended.converged);
  const Eigen::MatrixXd slopes = network.slopes(step, ended);
  for (int j = 0; j < 3; ++j) {
    const double d = 1e-6 * volume;
    GasNetwork::Step more = step;
    GasNetwork::Step less = step;
    more.volume[j] += d;
    less.volume[j] -= d;
    const Eigen::VectorXd slope = (network.solve(more).pressure - network.solve(less).pressure) / (2 * d);
    EXPECT_LT((slopes.col(j) - slope).norm(), 1e-6 * slopes.norm()) << j;
  }
}

TEST(GasNetwork, BadLinksAreNamed) {
  const auto message = [](const GasNetwork::Link& link) {
    try {
      GasNetwork({vessel(false), {false, 1.2, volume}}, {link}, GasOptions());
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  GasNetwork::Link link = hole(1e-4);
  EXPECT_EQ(message(link), "");
  link.options.opens = {{0, 1.5}};
  EXPECT_EQ(message(link), "gas_network.links.hole.opens: 1.5 at 0 s, expected at least 0 and at most 1");
  link = hole(1e-4);
  link.options.flow = {{0, 1}};
  EXPECT_EQ(message(link), "gas_network.links.hole: both area and flow given, expected one of them");
  link = hole(1e-4);
  link.to = 1;
  EXPECT_EQ(message(link), "gas_network.links.hole: joins chambers of unlike gamma, expected one gas");
  link.from = 1;
  EXPECT_EQ(message(link), "gas_network.links.hole: from and to are the same, expected a chamber at one end at least");
}

}  // namespace
}  // namespace pellicle
