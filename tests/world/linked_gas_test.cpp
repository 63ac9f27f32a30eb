// Links between chambers of different objects: the gas of all is one, solved together with all walls.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "gas/gas_options.h"
#include "meshing/closed_shapes.h"
#include "meshing/triangulation.h"
#include "tests/io/files.h"
#include "tests/support/balls.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"
#include "tests/world/several_objects.h"

namespace pellicle::linked_gas_test {
namespace {

constexpr double radius = 0.05;                            // [m]
const Eigen::Vector3d apart = Eigen::Vector3d(0.5, 0, 0);  // [m]

LinkOptions tube(const std::string& from, const std::string& to, double area) {
  LinkOptions link;
  link.from = from;
  link.to = to;
  link.area = area;
  return link;
}

LinkOptions pump(const std::string& to, double flow) {
  LinkOptions link;
  link.to = to;
  link.flow = {{0, flow}};
  link.temperature = 500;
  return link;
}

void write_to(Options& options, const std::string& directory) {
  options.force.gravity.setZero();
  options.output.directory = directory;
  options.output.name = "scene";
}

void make_balloon(Options& options, GasLaw law = GasLaw::adiabatic) {
  options.chain = ChainKind::inflate;
  options.prism.mass_damping = 20;
  options.prism.snes_rtol = 1e-11;
  options.prism.ksp_rtol = 1e-10;
  options.wall.thickness = 3e-4;
  options.wall.material.law = "mooney_rivlin";
  options.wall.material.c1 = 0.2e6;
  options.wall.material.c2 = 0.02e6;
  options.chambers["air"].law = law;
}

void make_bag(Options& options, GasLaw law = GasLaw::adiabatic) {
  options.chain = ChainKind::burn;
  options.sheet.thickness = 2e-3;
  options.sheet.areal_density = 0.05;
  options.elastic.newton_tolerance = 1e-9;
  options.chambers["air"].law = law;
}

SurfaceMesh ball(int level) { return icosphere_mesh(level, radius); }

/// A paper bag, flat.
SurfaceMesh bag() { return quad_ellipsoid_mesh(2, {0.06, 0.06, 0.02}); }

class LinkedBalloons : public ::testing::TestWithParam<TimeScheme> {};

TEST_P(LinkedBalloons, MoveAsThePiecesOfOneMeshDo) {
  const TestFolder folder;
  std::deque<NamedOptions> two;
  for (const char* name : {"left", "right"}) {
    Options& options = two.emplace_back(name).options;
    make_balloon(options);
    options.time.scheme = GetParam();
    write_to(options, folder / "two");
    options.gas.links["tube"] = tube("left.air", "right.air", 2e-4);  // As at the top of a deck.
    options.gas.links["vent"] = tube("right.air", "", 2e-6);
  }
  two[0].options.gas.links["pump"] = pump("air", 0.2);
  std::deque<NamedOptions> one;
  Options& options = one.emplace_back("").options;
  make_balloon(options);
  options.time.scheme = GetParam();
  write_to(options, folder / "one");
  options.gas.links["tube"] = tube("air", "air_2", 2e-4);
  options.gas.links["vent"] = tube("air_2", "", 2e-6);
  options.gas.links["pump"] = pump("air", 0.2);
  const auto points = static_cast<PetscInt>(ball(1).points.size());
  Scene objects(std::move(two), {ball(1), ball(1)});
  Scene pieces(std::move(one), {joined(ball(1), ball(1), apart)});
  for (int n = 0; n < 20; ++n) {
    objects.step(5e-3);
    pieces.step(5e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
  const Eigen::MatrixXd whole = by_id(pieces.object(0).surface(), pieces.object(0).state().position);
  const GasExchange& gas = *pieces.object(0).state().gas;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto piece = static_cast<PetscInt>(i);
    Eigen::MatrixXd own = by_id(objects.object(i).surface(), objects.object(i).state().position);
    own.colwise() += static_cast<double>(i) * apart;
    EXPECT_LT((own - whole.middleCols(piece * points, points)).cwiseAbs().maxCoeff(), 1e-7 * radius);
    EXPECT_NEAR(objects.object(i).state().gas->amount[0], gas.amount[piece], 1e-9 * std::abs(gas.amount[piece]));
    EXPECT_NEAR(objects.object(i).state().gas->work[0], gas.work[piece], 1e-7 * std::abs(gas.work[piece]));
  }
  EXPECT_GT(gas.amount[1], 1e-4) << "the tube feeds the other one";
  EXPECT_LE(objects.last("newton_iterations", "history_left.csv"), 6) << "with the tangent of all pressures";
}

INSTANTIATE_TEST_SUITE_P(Schemes, LinkedBalloons,
                         ::testing::Values(TimeScheme::implicit_euler, TimeScheme::generalized_alpha),
                         [](const auto& scheme) { return Choice<TimeScheme>(scheme.param).name(); });

class LinkedSheet : public ::testing::TestWithParam<Dynamics> {};

/// A balloon fills a paper bag. Amounts and energies of both balance to rounding, and pressures become alike.
void fill_bag(Dynamics dynamics, TimeScheme scheme) {
  const TestFolder folder;
  std::deque<NamedOptions> objects;
  make_balloon(objects.emplace_back("ball").options);
  make_bag(objects.emplace_back("bag").options);
  objects.back().options.dynamics = dynamics;
  for (NamedOptions& object : objects) {
    write_to(object.options, folder / "out");
    object.options.time.scheme = scheme;
    object.options.gas.links["tube"] = tube("ball.air", "bag.air", 2e-4);
  }
  objects[0].options.chambers["air"].amount_ratio = {{0, 1.05}};
  Scene scene(std::move(objects), {ball(2), bag()});
  const auto value = [&](const std::string& name, const std::string& column) {
    return scene.last(column, "history_" + name + ".csv");
  };
  const double amounts[2] = {value("ball", "gas_amount"), value("bag", "gas_amount")};
  const double energies[2] = {value("ball", "gas_energy"), value("bag", "gas_energy")};
  for (int n = 0; n < 50; ++n) {
    scene.step(2e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    const double through = value("ball", "through_tube");
    const double enthalpy = value("ball", "enthalpy_tube");
    EXPECT_EQ(value("bag", "through_tube"), through);
    EXPECT_EQ(value("bag", "enthalpy_tube"), enthalpy);
    EXPECT_NEAR(value("ball", "gas_amount"), amounts[0] - through, 1e-13 * amounts[0]);
    EXPECT_NEAR(value("bag", "gas_amount"), amounts[1] + through, 1e-13 * amounts[1]);
    EXPECT_NEAR(value("ball", "gas_energy") + value("ball", "gas_work"), energies[0] - enthalpy, 1e-11 * energies[0]);
    EXPECT_NEAR(value("bag", "gas_energy") + value("bag", "gas_work"), energies[1] + enthalpy, 1e-11 * energies[1]);
  }
  // A net of hard springs hardly gives way: of what it gets only the pressure rises.
  const double fraction = dynamics == Dynamics::projection ? 0.003 : 0.01;
  EXPECT_GT(value("ball", "through_tube"), fraction * amounts[0]);
  const double pressure = value("ball", "gas_pressure");
  EXPECT_GT(pressure, 20);
  EXPECT_NEAR(value("bag", "gas_pressure"), pressure, 0.1 * pressure);
}

TEST_P(LinkedSheet, GetsWhatTheOtherObjectLoses) { fill_bag(GetParam(), TimeScheme::implicit_euler); }

TEST(LinkedGas, ASheetByGeneralizedAlphaGetsWhatTheOtherObjectLoses) {
  fill_bag(Dynamics::elastic, TimeScheme::generalized_alpha);
}

TEST_P(LinkedSheet, MovesAsAPieceOfOneDoes) {
  // Of one sheet the pressures are found by solving the step again and again; of two elastic ones by Newton's method
  // with the walls.
  const TestFolder folder;
  std::deque<NamedOptions> two;
  for (const char* name : {"left", "right"}) {
    Options& options = two.emplace_back(name).options;
    make_bag(options);
    options.dynamics = GetParam();
    write_to(options, folder / "two");
    options.gas.links["tube"] = tube("left.air", "right.air", 2e-4);
  }
  two[0].options.gas.links["pump"] = pump("air", 0.02);
  std::deque<NamedOptions> one;
  Options& options = one.emplace_back("").options;
  make_bag(options);
  options.dynamics = GetParam();
  write_to(options, folder / "one");
  options.gas.links["tube"] = tube("air", "air_2", 2e-4);
  options.gas.links["pump"] = pump("air", 0.02);
  const SurfaceMesh pair = joined(bag(), bag(), apart);
  Scene objects(std::move(two), {bag(), bag()});
  Scene pieces(std::move(one), {pair});
  for (int n = 0; n < 20; ++n) {
    objects.step(2e-3);
    pieces.step(2e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
  const GasExchange& gas = *pieces.object(0).state().gas;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto piece = static_cast<PetscInt>(i);
    const GasExchange& own = *objects.object(i).state().gas;
    EXPECT_NEAR(own.amount[0], gas.amount[piece], 1e-3 * std::abs(gas.amount[piece]));
    EXPECT_NEAR(own.volume[0], gas.volume[piece], 1e-4 * gas.volume[piece]);
  }
  EXPECT_GT(gas.amount[1], 1e-4);
  if (GetParam() == Dynamics::elastic) {
    EXPECT_LE(objects.last("newton_iterations", "history_left.csv"), 8);
  }
}

INSTANTIATE_TEST_SUITE_P(Dynamics, LinkedSheet,
                         ::testing::Values(Dynamics::elastic, Dynamics::projection, Dynamics::spring),
                         [](const auto& dynamics) { return Choice<Dynamics>(dynamics.param).name(); });

TEST(LinkedGas, PressuresOfProjectedAndSpringSheetsDoNotDependOnTheStep) {
  // A rigid bag gets its fraction of the gas whatever the step; one that were taken for a free one would take too much.
  const TestFolder folder;
  double pressure[2];
  for (const int halved : {0, 1}) {
    std::deque<NamedOptions> objects;
    make_balloon(objects.emplace_back("ball").options, GasLaw::isothermal);
    make_bag(objects.emplace_back("soft").options, GasLaw::isothermal);
    make_bag(objects.emplace_back("hard").options, GasLaw::isothermal);
    objects[1].options.dynamics = Dynamics::spring;
    objects[2].options.dynamics = Dynamics::projection;
    for (NamedOptions& object : objects) {
      write_to(object.options, folder / std::to_string(halved));
      object.options.gas.links["to_soft"] = tube("ball.air", "soft.air", 1e-4);
      object.options.gas.links["to_hard"] = tube("soft.air", "hard.air", 1e-4);
    }
    objects[0].options.gas.links["pump"] = pump("air", 0.05);
    share_links(objects);
    Scene scene(std::move(objects), {ball(1), bag(), bag()});
    for (int n = 0; n < 20 << halved; ++n) {
      scene.step(2e-3 / (1 << halved));
      ASSERT_FALSE(::testing::Test::HasFatalFailure());
    }
    pressure[halved] = scene.last("gas_pressure", "history_hard.csv");
  }
  EXPECT_GT(pressure[0], 10);
  EXPECT_NEAR(pressure[0], pressure[1], 0.05 * pressure[1]);
}

std::string refusal(std::deque<NamedOptions>& objects) {
  return error_text([&] { share_links(objects); });
}

// A projected sheet is projected only when the balance of the balloon is known, and its contact acts then.
TEST(LinkedGas, AProjectedSheetTouchesItself) {
  const TestFolder folder;
  std::deque<NamedOptions> objects;
  make_balloon(objects.emplace_back("ball").options);
  make_bag(objects.emplace_back("bag").options);
  for (NamedOptions& object : objects) {
    write_to(object.options, folder / "out");
    object.options.gas.links["tube"] = tube("ball.air", "bag.air", 2e-4);
  }
  LinkOptions& pump = objects[1].options.gas.links["pump"];  // It empties the bag, whose sides come together.
  pump.from = "bag.air";
  pump.flow = {{0, 0.3}};
  objects[1].options.dynamics = Dynamics::projection;
  objects[1].options.contact.self = true;
  objects[1].options.contact.thickness = 0.03;
  Scene scene(std::move(objects), {ball(2), bag()});
  for (int n = 0; n < 25; ++n) {
    scene.step(2e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
  EXPECT_GT(scene.last("contacts"), 0);
  EXPECT_GT(scene.last("through_tube", "history_bag.csv"), 0);
}

TEST(LinkedGas, EveryLinkBelongsToTheObjectsThatItJoins) {
  std::deque<NamedOptions> objects;
  for (const char* name : {"a", "b", "c"}) {
    objects.emplace_back(name).options.gas.links["top"] = tube("a.air", "b.air", 1);
  }
  objects[2].options.gas.links["own"] = tube("air", "ambient", 2);
  objects[2].options.gas.links["away"] = tube("air", "a.air_2", 3);
  objects[0].options.gas.links["of_b"] = tube("b.air", "", 4);
  EXPECT_EQ(refusal(objects), "no Error");
  const auto names = [&](std::size_t i) {
    std::string all;
    for (const auto& [name, link] : objects[i].options.gas.links) {
      all += name + "(" + link.from + ">" + link.to + ")";
    }
    return all;
  };
  EXPECT_EQ(names(0), "away(c.air>air_2)top(air>b.air)");
  EXPECT_EQ(names(1), "of_b(air>)top(a.air>air)");
  EXPECT_EQ(names(2), "away(air>a.air_2)own(air>ambient)");
  EXPECT_LT(plan_run(objects).groups.size(), objects.size());
}

TEST(LinkedGas, LinksThatGoNowhereAreRefused) {
  const auto with = [](const LinkOptions& link) {
    std::deque<NamedOptions> objects;
    objects.emplace_back("a").options.gas.links["tube"] = link;
    objects.emplace_back("b");
    return objects;
  };
  std::deque<NamedOptions> objects = with(tube("air", "d.air", 1));
  EXPECT_EQ(refusal(objects), "gas_network.links.tube.to: d.air: there is no object d, expected a chamber of a, b");
  objects = with(tube("air", "b.air", 1));
  objects[1].options.gas.links["tube"] = tube("air", "", 1);
  EXPECT_EQ(refusal(objects),
            "b: gas_network.links.tube: ends in b, where another link has this name, expected another one");
  std::deque<NamedOptions> one;
  one.emplace_back("").options.gas.links["tube"] = tube("air", "b.air", 1);
  EXPECT_EQ(refusal(one),
            "gas_network.links.tube.to: b.air: the run has one object, without a name, expected a chamber "
            "of it or ambient");
}

TEST(LinkedGas, WhatDoesNotFitTheOtherObjectIsRefused) {
  const TestFolder folder;
  const auto message = [&](const std::function<void(Options & a, Options & b)>& change) {
    std::deque<NamedOptions> objects;
    for (const char* name : {"a", "b"}) {
      make_balloon(objects.emplace_back(name).options);
      write_to(objects.back().options, folder / "out");
    }
    objects[0].options.gas.links["tube"] = tube("air", "b.air", 1);
    change(objects[0].options, objects[1].options);
    return error_text([&] { const Scene scene(std::move(objects), {ball(1), ball(1)}); });
  };
  EXPECT_EQ(message([](Options& a, Options&) { a.gas.links["tube"].to = "b.gas"; }),
            "gas_network.links.tube.to: there is no chamber gas, expected air or ambient");
  EXPECT_EQ(message([](Options&, Options& b) { b.gas.molar_mass = 4e-3; }),
            "b: gas.molar_mass: 0.004, expected 0.0289647 as of a, to whose chambers its own are linked");
  EXPECT_EQ(
      message([](Options&, Options& b) { b.time.scheme = TimeScheme::generalized_alpha; }),
      "b: time.scheme: generalized_alpha of spectral radius 0.8, expected implicit_euler as of a, to whose chambers "
      "its own are linked");
  EXPECT_EQ(message([](Options&, Options& b) { b.chambers["air"].gamma = 1.6; }),
            "gas_network.links.tube: joins chambers of unlike gamma, expected one gas");
}

}  // namespace
}  // namespace pellicle::linked_gas_test
