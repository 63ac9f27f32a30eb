// Gas that flows between objects, and between a chamber and one inside it, by the whole program.

#include <array>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>

#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/run_checks.h"

namespace pellicle::linked_gas_test {
namespace {

/// A balloon that is pumped up feeds a paper bag by a tube from the first step on, and the bag leaks.
const std::string balloon_and_bag = R"(
gas_network: {links: {tube: {from: ball.air, to: bag.air, area: 1 cm^2}}}
objects:
  ball:
    mesh: {shape: icosphere, level: 1, radius: 5 cm}
    wall: {thickness: 0.3 mm, material: mooney_rivlin, c1: 0.2 MPa, c2: 20 kPa}
    prism: {mass_damping: 20 1/s, snes_rtol: 1e-10, ksp_rtol: 1e-9}
    chambers: {air: {law: adiabatic}}
    gas_network: {links: {pump: {to: air, flow: [[0, 0.5]]}}}
  bag:
    mesh: {shape: quad_ellipsoid, level: 1, semi_axes: [6 cm, 6 cm, 3 cm], shift: [0.3 m, 0, 0]}
    sheet: {thickness: 2 mm, areal_density: 0.05}
    chambers: {air: {law: adiabatic}}
    gas_network: {links: {vent: {from: air, area: 1 mm^2}}}
force: {gravity: [0, 0, 0]}
time: {step: 2 ms, end: 40 ms}
output: {name: scene, interval_time: 20 ms}
)";

/// What solves tightly, by what holds the sheet together.
const std::map<std::string, Arguments> tight{{"elastic", {"-objects_bag_elastic_newton_tolerance", "1e-9"}},
                                             {"projection", {"-objects_bag_project_ksp_rtol", "1e-11"}},
                                             {"spring", {}}};

class LinkedGasTest : public ProgramTest {
 protected:
  std::map<std::string, std::vector<double>> history(const std::string& out, const std::string& object) const {
    return history_of(folder() / out, object);
  }
};

TEST_F(LinkedGasTest, BalancesAndIsTheSameOnAnyRanksAndWhenItGoesOn) {
  const std::string deck = write("scene.yaml", balloon_and_bag);
  std::map<std::string, std::vector<double>> one;
  for (const auto& [ranks, dynamics] : std::vector<std::pair<int, std::string>>{
           {1, "projection"}, {2, "projection"}, {1, "spring"}, {3, "spring"}, {1, "elastic"}, {3, "elastic"}}) {
    const std::string out = dynamics + "_on_" + std::to_string(ranks);
    succeed(ranks, Arguments{deck, "-output_directory", out, "-objects_bag_dynamics", dynamics} + tight.at(dynamics));
    const auto ball = history(out, "ball");
    const auto bag = history(out, "bag");
    EXPECT_EQ(ball.at("through_tube"), bag.at("through_tube"));
    const double amount = ball.at("gas_amount")[0] + bag.at("gas_amount")[0];
    EXPECT_NEAR(ball.at("gas_amount").back() + bag.at("gas_amount").back(),
                amount + ball.at("through_pump").back() - bag.at("through_vent").back(), 1e-13 * amount);
    const double fraction = dynamics == "projection" ? 0.02 : 0.2;  // A net of hard springs hardly gives way.
    EXPECT_GT(ball.at("through_tube").back(), fraction * ball.at("through_pump").back());
    EXPECT_GT(std::abs(bag.at("through_vent").back()), 0);
    one = ranks == 1 ? bag : one;
    for (const char* name : {"gas_amount", "gas_pressure", "gas_volume"}) {
      EXPECT_NEAR(bag.at(name).back(), one.at(name).back(), 1e-6 * std::abs(one.at(name).back())) << name;
    }
  }
  for (const auto& [dynamics, options] : tight) {
    const std::string printed = succeed(2, Arguments{deck, "-verify_restart", "8", "-output_directory",
                                                     "again_" + dynamics, "-objects_bag_dynamics", dynamics} +
                                               options)
                                    .output;
    EXPECT_NE(printed.find("fields are the same"), std::string::npos) << printed;
  }
}

TEST_F(LinkedGasTest, WhatIsNotThereIsRefusedInALine) {
  const std::string deck = write("scene.yaml", balloon_and_bag);
  const auto refused = [&](const Arguments& more, const std::string& words) {
    const CommandResult result = pellicle(2, Arguments{deck, "-output_directory", "out"} + more);
    EXPECT_EQ(result.exit_code, 1) << result;
    ASSERT_EQ(result.error_lines().size(), 1U) << result;
    EXPECT_NE(result.error_lines().front().find(words), std::string::npos) << result;
    EXPECT_FALSE(std::filesystem::exists(folder() / "out"));
  };
  refused({"-gas_network_links_tube_to", "box.air"},
          "gas_network.links.tube.to: box.air: there is no object box, expected a chamber of ball, bag");
  refused({"-gas_network_links_tube_to", "bag.gas"},
          "bag: gas_network.links.tube.to: there is no chamber gas, expected air or ambient");
  refused({"-gas_network_links_tube_to", "ball.air"},
          "ball: gas_network.links.tube: from and to are the same, expected a chamber at one end at least");
  refused({"-gas_network_links_tube_area", "-1"}, "gas_network_links_tube_area");
  refused({"-objects_bag_gas_network_links_tube_area", "2"},
          "bag: gas_network.links.tube: ends in ball, where another link has this name, expected another one");
  refused({"-objects_bag_dynamics", "projection", "-contact_self"},
          "bag: contact.self: true of several objects, and gas_network.links to a chamber of another, do not go with "
          "dynamics: projection, expected elastic");
  refused({"-time_scheme", "generalized_alpha", "-objects_bag_dynamics", "projection"},
          "bag: time.scheme: generalized_alpha does not go with dynamics: projection, whose springs have no forces");
}

/// A ball of quads, a cube of so many cells a side that is blown up, after other points of a mesh.
void add_ball(std::vector<std::array<double, 3>>& points, std::vector<std::array<std::size_t, 4>>& quads, int cells,
              double radius, double shift) {
  std::map<std::array<int, 3>, std::size_t> numbers;
  const auto number = [&](const std::array<int, 3>& at) {
    const auto [found, is_new] = numbers.try_emplace(at, points.size());
    if (is_new) {
      std::array<double, 3> x{};
      for (std::size_t k = 0; k < 3; ++k) {
        x[k] = std::tan((2.0 * at[k] / cells - 1) * std::atan(1.0));
      }
      const double length = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
      points.push_back({radius * x[0] / length + shift, radius * x[1] / length, radius * x[2] / length});
    }
    return found->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const int side : {0, cells}) {
      for (int i = 0; i < cells; ++i) {
        for (int j = 0; j < cells; ++j) {
          std::array<std::size_t, 4> quad{};
          for (std::size_t k = 0; k < 4; ++k) {
            std::array<int, 3> at{};
            at[axis] = side;
            at[(axis + 1) % 3] = i + (k == 1 || k == 2 ? 1 : 0);
            at[(axis + 2) % 3] = j + (k > 1 ? 1 : 0);
            quad[k] = number(at);
          }
          if (side == 0) {
            std::swap(quad[1], quad[3]);
          }
          quads.push_back(quad);
        }
      }
    }
  }
}

/// A paper ball in a paper ball, whose upper half a flame burns.
const std::string ball_in_ball = R"(
mesh: {file: balls.off}
sheet: {thickness: 4 mm, areal_density: 0.05, perturbation: 0.005}
force: {gravity: [0, 0, 0]}
chambers:
  outer: {law: adiabatic, vertex: 0}
  inner: {law: adiabatic, vertex: 98, inside: outer, hole_discharge: 0.6, amount_ratio: [[0, 1.002]], heat_transfer: 5}
gas_network: {links: {valve: {from: inner, area: 1 mm^2}}}
heat:
  diffusivity: 1e-4
  sources: {flame: {shape: ball, radius: 10 cm, temperature: 1500 K, rate: 2000, path: [[0, 0.02, 0, 0.03]]}}
combustion: {ignition_temperature: 600 K, mass_loss_rate: 0.5, min_mass: 0.2}
ablation: {loss_mass: 0.4}
time: {step: 4 ms, end: 0.1 s}
output: {name: balls, interval_time: 50 ms}
)";

TEST_F(LinkedGasTest, AChamberInAnotherThatBurnsBecomesOneWithIt) {
  std::vector<std::array<double, 3>> points;
  std::vector<std::array<std::size_t, 4>> quads;
  add_ball(points, quads, 4, 0.2, 0);
  add_ball(points, quads, 3, 0.12, 0.02);
  std::ostringstream mesh;
  mesh.precision(12);
  mesh << "OFF\n" << points.size() << " " << quads.size() << " 0\n";
  for (const auto& [x, y, z] : points) {
    mesh << x << " " << y << " " << z << "\n";
  }
  for (const auto& [a, b, c, d] : quads) {
    mesh << "4 " << a << " " << b << " " << c << " " << d << "\n";
  }
  write("balls.off", mesh.str());
  const std::string deck = write("balls.yaml", ball_in_ball);
  const std::string printed = succeed(2, {deck, "-output_directory", "out"}).output;
  EXPECT_EQ(count(printed, "chamber inner becomes a part of outer at 0.0[0-9]* s: its holes are large"), 1) << printed;
  const auto table = history_of(folder() / "out");
  const std::vector<double>& amount = table.at("gas_amount");
  const std::vector<double>& through = table.at("through_valve");
  for (std::size_t row = 0; row < amount.size(); ++row) {
    EXPECT_NEAR(amount[row] + through[row], amount[0], 1e-13 * amount[0]);
    EXPECT_EQ(table.at("gas_leak")[row], 0) << "into the air";
  }
  EXPECT_LT(table.at("gas_amount_inner")[amount.size() / 2], 0.9 * table.at("gas_amount_inner")[0]) << "by its hole";
  EXPECT_EQ(table.at("gas_amount_inner").back(), 0);
  EXPECT_EQ(table.at("gas_pressure_inner").back(), 0);
  EXPECT_NEAR(table.at("gas_volume_outer").back(), table.at("gas_volume")[0], 0.01 * table.at("gas_volume")[0]);
  EXPECT_GT(through.back(), through[through.size() - 3]) << "the valve goes on from the outer one";
  for (const int ranks : {1, 2}) {  // It becomes one behind the checkpoint.
    const std::string again =
        succeed(ranks, {deck, "-verify_restart", "10", "-output_directory", "again_" + std::to_string(ranks)}).output;
    EXPECT_NE(again.find("fields are the same"), std::string::npos) << again;
    EXPECT_NE(again.find("becomes a part of outer"), std::string::npos) << again;
  }
}

}  // namespace
}  // namespace pellicle::linked_gas_test
