#include "gas/chambers.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "base/error.h"
#include "geometry/pi.h"
#include "parallel/collective.h"
#include "tests/gas/membranes.h"

namespace pellicle {
namespace {

constexpr double ambient = 1e5;  // [Pa]
constexpr double radius = 0.1;   // [m]

using ChamberMap = std::map<std::string, ChamberOptions>;

GasOptions gas_options() {
  GasOptions options;
  options.ambient_pressure = ambient;
  return options;
}

Chambers chambers_of(const Membrane& membrane, const ChamberMap& options) {
  return {membrane, gas_options(), options, Eigen::Vector3d::Zero(), {}, free_to_move(membrane)};
}

ChamberOptions relative(double p0) {
  ChamberOptions options;
  options.pressure = {{0, p0}};
  return options;
}

ChamberOptions of_law(const std::string& law) {
  ChamberOptions options;
  options.law = law;
  return options;
}

double derivative(const std::function<double(double)>& function, double x, double step) {
  return (8 * (function(x + step) - function(x - step)) - (function(x + 2 * step) - function(x - 2 * step))) /
         (12 * step);
}

// --- Volumes -----------------------------------------------------------------------------------------------------

TEST(Chambers, VolumeOfACubeIsExactWhereverItIs) {
  const Membrane cube = membrane_of(cube_mesh(2));
  const Chambers chambers = chambers_of(cube, {{"air", relative(1)}});
  ASSERT_EQ(chambers.count(), 1);
  EXPECT_EQ(chambers.name(0), "air");
  EXPECT_NEAR(chambers.initial_volume(0), 8, 1e-14);
  Field moved = rest_positions(cube);
  moved.values().colwise() += Eigen::Vector3d(3, -5, 1);
  EXPECT_NEAR(chambers.volumes(moved)[0], 8, 1e-13);
}

TEST(Chambers, VolumeOfASphereConvergesInSecondOrder) {
  const double exact = 4 * pi / 3 * std::pow(radius, 3);
  double coarse = 0;
  for (int level = 1; level <= 3; ++level) {
    const Membrane sphere = membrane_of(icosphere_mesh(level, radius));
    const double error = 1 - chambers_of(sphere, {{"air", relative(1)}}).initial_volume(0) / exact;
    if (level > 1) {
      EXPECT_NEAR(coarse / error, 4, 0.3) << "level " << level;
    }
    coarse = error;
  }
  EXPECT_LT(coarse, 0.01);
}

TEST(Chambers, GradientIsTheDerivativeOfTheVolume) {
  const Membrane sphere = membrane_of(icosphere_mesh(1, radius));
  const Chambers chambers = chambers_of(sphere, {{"air", relative(1)}});
  Field x = rest_positions(sphere);
  x.values() += 0.2 * radius * scattered(sphere, 1).values();
  const Field w = scattered(sphere, 2);
  Field moved(sphere.particles, 3);
  const auto volume = [&](double s) {
    moved.values() = x.values() + s * w.values();
    return chambers.volumes(moved)[0];
  };
  const double exact = dot(sphere, chambers.volume_gradient(0, x), w.values());
  EXPECT_NEAR(derivative(volume, 0, 0.05), exact, 1e-11 * std::abs(exact));
}

TEST(Chambers, NetPressureForceAndTorqueAreZero) {
  const Membrane sphere = membrane_of(icosphere_mesh(2, radius));
  const Chambers chambers = chambers_of(sphere, {{"air", relative(1)}});
  Field x = rest_positions(sphere);
  x.values() += 0.1 * radius * scattered(sphere, 1).values();
  const Eigen::Matrix3Xd gradient = chambers.volume_gradient(0, x);
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (PetscInt i = 0; i < sphere.particles.owned; ++i) {
    torque += x.vector(i).cross(Eigen::Vector3d(gradient.col(i)));
  }
  const double area = sum_over_ranks(PETSC_COMM_WORLD, gradient.colwise().norm().sum());
  EXPECT_GT(area, 3.9 * pi * radius * radius);
  EXPECT_LT(sum_over_world(gradient.rowwise().sum()).norm(), 1e-14 * area);
  EXPECT_LT(sum_over_world(torque).norm(), 1e-14 * area * radius);
}

// --- Pieces ------------------------------------------------------------------------------------------------------

class TwoSpheres : public ::testing::Test {
 protected:
  TwoSpheres() : membrane(membrane_of(joined(first, second, {4 * radius, 0, 0}))) {}

  const SurfaceMesh first = icosphere_mesh(1, radius);
  const SurfaceMesh second = icosphere_mesh(1, 2 * radius);
  const int in_second = static_cast<int>(first.points.size());
  const Membrane membrane;
};

TEST_F(TwoSpheres, AChamberWithoutAVertexStandsForEveryPiece) {
  const Chambers chambers = chambers_of(membrane, {{"air", relative(1)}});
  ASSERT_EQ(chambers.count(), 2);
  EXPECT_EQ(chambers.name(0), "air");
  EXPECT_EQ(chambers.name(1), "air_2");
  EXPECT_NEAR(chambers.initial_volume(1) / chambers.initial_volume(0), 8, 1e-12);
}

TEST_F(TwoSpheres, AVertexNamesAPieceAndGradientsStayOnIt) {
  ChamberOptions named = relative(1);
  named.vertex = in_second + 5;
  const Chambers chambers = chambers_of(membrane, {{"a_big", named}, {"b_rest", of_law("isothermal")}});
  ASSERT_EQ(chambers.count(), 2);
  EXPECT_EQ(chambers.name(0), "a_big");
  EXPECT_EQ(chambers.name(1), "b_rest");
  EXPECT_NEAR(chambers.initial_volume(0) / chambers.initial_volume(1), 8, 1e-12);
  const Eigen::Matrix3Xd gradient = chambers.volume_gradient(0, rest_positions(membrane));
  for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
    EXPECT_EQ(gradient.col(i).isZero(0), membrane.persistent_id[i] < in_second);
  }
  for (PetscInt element = 0; element < membrane.elements.local(); ++element) {
    EXPECT_EQ(chambers.of_triangle(element), membrane.piece[element] == 1 ? 0 : 1);
  }
}

TEST_F(TwoSpheres, APieceThatNoChamberNamesBoundsNone) {
  ChamberOptions named = relative(1);
  named.vertex = 0;
  const Chambers chambers = chambers_of(membrane, {{"air", named}});
  ASSERT_EQ(chambers.count(), 1);
  for (PetscInt element = 0; element < membrane.elements.local(); ++element) {
    EXPECT_EQ(chambers.of_triangle(element), membrane.piece[element] == 0 ? 0 : -1);
  }
}

/// The upper half of a sphere, moved up by `height`, whose boundary vertices stay in their plane.
class HalfSphere : public ::testing::Test {
 protected:
  explicit HalfSphere(double height = 0.3) : plane(0, 0, height) {
    SurfaceMesh mesh = dome_mesh(2, radius);
    for (Eigen::Vector3d& point : mesh.points) {
      point += plane;
    }
    membrane = membrane_of(mesh);
    projectors = free_to_move(membrane);
    planes.normals = {Eigen::Vector3d::UnitZ()};
    planes.of_particle.assign(projectors.size(), 0);
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      if (std::abs(membrane.rest(2, i) - height) < 1e-12) {
        projectors.bind(static_cast<std::size_t>(i), Eigen::Vector3d(1, 1, 0).asDiagonal());
        planes.of_particle[i] = 1;
      }
    }
  }

  Eigen::Vector3d plane;
  Membrane membrane;
  SymmetryPlanes planes;
  Projectors projectors;
};

TEST_F(HalfSphere, ASymmetryPlaneClosesAPiece) {
  const Chambers chambers(membrane, gas_options(), {{"air", relative(1)}}, plane, planes, projectors);
  const Membrane whole = membrane_of(icosphere_mesh(2, radius));
  EXPECT_NEAR(chambers.initial_volume(0) / chambers_of(whole, {{"air", relative(1)}}).initial_volume(0), 0.5, 1e-14);
}

TEST_F(HalfSphere, AnOpenPieceHasNoVolumeButMayHaveAPressure) {
  const auto refused = [&](const SymmetryPlanes& known, const Projectors& free, const std::string& words) {
    try {
      const Chambers chambers(membrane, gas_options(), {{"air", relative(1)}}, plane, known, free);
      ADD_FAILURE() << "no error: " << words;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  refused({}, projectors, "chambers.air.law: relative needs a volume, but the piece is open, expected");
  refused(planes, free_to_move(membrane),
          "chambers.air.law: relative needs a volume, but the piece is open at vertex ");
  ChamberOptions prescribed = of_law("pressure");
  prescribed.pressure = {{0, 500}};
  EXPECT_EQ(chambers_of(membrane, {{"air", prescribed}}).state(0, 0, 0).pressure, 500);
}

// --- Laws --------------------------------------------------------------------------------------------------------

class GasLaw : public ::testing::Test {
 protected:
  Chambers gas(const ChamberOptions& options) const { return chambers_of(cube, {{"air", options}}); }

  /// Slope and potential against differences in the volume.
  static void expect_consistent(const Chambers& gas, double volume, double time) {
    const GasState state = gas.state(0, volume, time);
    const double step = 1e-3 * volume;
    const auto pressure = [&](double v) { return gas.state(0, v, time).pressure; };
    const auto potential = [&](double v) { return gas.state(0, v, time).potential; };
    EXPECT_NEAR(derivative(potential, volume, step), -state.pressure, 1e-9 * (std::abs(state.pressure) + ambient));
    EXPECT_NEAR(derivative(pressure, volume, step), state.pressure_slope,
                1e-9 * (std::abs(state.pressure_slope) + ambient / volume));
  }

  static constexpr double v0 = 8;  // of the cube [m^3]
  const Membrane cube = membrane_of(cube_mesh(2));
};

TEST_F(GasLaw, RelativeIsThePapers) {
  const Chambers chambers = gas(relative(7000));
  for (const double volume : {0.5, 8.0, 24.0}) {
    const GasState state = chambers.state(0, volume, 0);
    EXPECT_NEAR(state.pressure * volume, 7000 * v0, 1e-14 * 7000 * v0);
    EXPECT_EQ(state.absolute_pressure, state.pressure);
    EXPECT_EQ(state.volume, volume);
    expect_consistent(chambers, volume, 0);
  }
}

TEST_F(GasLaw, RelativeFollowsKeyPoints) {
  ChamberOptions ramp;
  ramp.pressure = {{0, 0}, {2, 7000}};
  const Chambers chambers = gas(ramp);
  EXPECT_EQ(chambers.state(0, v0, 0).pressure, 0);
  EXPECT_NEAR(chambers.state(0, v0, 0.5).pressure, 1750, 1e-9);
  EXPECT_NEAR(chambers.state(0, 2 * v0, 3).pressure, 3500, 1e-9);
}

TEST_F(GasLaw, IsothermalStartsInBalanceAndKeepsPV) {
  const Chambers chambers = gas(of_law("isothermal"));
  EXPECT_NEAR(chambers.state(0, v0, 0).pressure, 0, 1e-9);
  for (const double volume : {0.5, 8.0, 24.0}) {
    const GasState state = chambers.state(0, volume, 0);
    EXPECT_NEAR(state.absolute_pressure * volume, ambient * v0, 1e-14 * ambient * v0);
    EXPECT_NEAR(state.pressure, state.absolute_pressure - ambient, 1e-9);
    EXPECT_NEAR(state.amount, ambient * v0 / (8.31446261815324 * 293.15), 1e-9);
    EXPECT_EQ(state.temperature, 293.15);
    expect_consistent(chambers, volume, 0);
  }
}

TEST_F(GasLaw, IsothermalFollowsAmountAndTemperature) {
  ChamberOptions options = of_law("isothermal");
  options.amount = {{0, 100}, {1, 300}};
  options.temperature = {{0, 300}, {2, 400}};
  const Chambers chambers = gas(options);
  for (const double time : {0.0, 0.5, 1.5, 9.0}) {
    const double amount = 100 + 200 * std::min(time, 1.0);
    const double temperature = 300 + 50 * std::min(time, 2.0);
    const GasState state = chambers.state(0, 5, time);
    EXPECT_NEAR(state.amount, amount, 1e-12 * amount);
    EXPECT_NEAR(state.temperature, temperature, 1e-12 * temperature);
    EXPECT_NEAR(state.absolute_pressure * 5, amount * 8.31446261815324 * temperature, 1e-8);
    expect_consistent(chambers, 5, time);
  }
}

TEST_F(GasLaw, AmountRatioIsAgainstWhatFillsTheChamberAtFirst) {
  ChamberOptions options = of_law("isothermal");
  options.amount_ratio = {{0, 1}, {1, 3}};
  options.temperature = {{0, 250}, {1, 500}};
  const Chambers chambers = gas(options);
  EXPECT_NEAR(chambers.state(0, v0, 0).pressure, 0, 1e-9);
  EXPECT_NEAR(chambers.state(0, v0, 1).pressure, 5 * ambient, 1e-8);
}

TEST_F(GasLaw, AdiabaticKeepsPVToTheGamma) {
  ChamberOptions options = of_law("adiabatic");
  for (const double gamma : {1.4, 1.667}) {
    if (gamma != 1.4) {
      options.gamma = gamma;
    }
    const Chambers chambers = gas(options);
    for (const double volume : {0.5, 8.0, 24.0}) {
      const GasState state = chambers.state(0, volume, 0);
      const double entropy = ambient * std::pow(v0, gamma);
      EXPECT_NEAR(state.absolute_pressure * std::pow(volume, gamma), entropy, 1e-14 * entropy);
      EXPECT_NEAR(state.absolute_pressure * volume, state.amount * 8.31446261815324 * state.temperature,
                  1e-14 * state.absolute_pressure * volume);
      EXPECT_NEAR(state.temperature, 293.15 * std::pow(v0 / volume, gamma - 1), 1e-11);
      expect_consistent(chambers, volume, 0);
    }
  }
}

TEST_F(GasLaw, AdiabaticFillingScalesWithTheAmount) {
  ChamberOptions options = of_law("adiabatic");
  options.amount_ratio = {{0, 1}, {1, 2}};
  options.temperature = {{0, 350}};
  const Chambers chambers = gas(options);
  EXPECT_NEAR(chambers.state(0, 2 * v0, 1).absolute_pressure, 2 * ambient * std::pow(0.5, 1.4), 1e-9);
  EXPECT_NEAR(chambers.state(0, v0, 1).temperature, 350, 1e-12);
}

TEST_F(GasLaw, PrescribedPressureIsGaugeAndHasNoSlope) {
  ChamberOptions options = of_law("pressure");
  options.pressure = {{0, 0}, {1, -300}};
  const Chambers chambers = gas(options);
  const GasState state = chambers.state(0, 5, 1);
  EXPECT_EQ(state.pressure, -300);
  EXPECT_EQ(state.absolute_pressure, ambient - 300);
  EXPECT_EQ(state.pressure_slope, 0);
  EXPECT_FALSE(chambers.prescribes_volume(0));
  expect_consistent(chambers, 5, 1);
}

TEST_F(GasLaw, PrescribedVolume) {
  ChamberOptions options = of_law("volume");
  options.volume_ratio = {{0, 1}, {1, 3}};
  const Chambers by_ratio = gas(options);
  EXPECT_TRUE(by_ratio.prescribes_volume(0));
  EXPECT_NEAR(by_ratio.prescribed_volume(0, 0.5), 2 * v0, 1e-13);
  EXPECT_EQ(by_ratio.state(0, 5, 0.5).pressure, 0);
  options.volume_ratio.clear();
  options.volume = {{0, 8}, {1, 10}};
  EXPECT_NEAR(gas(options).prescribed_volume(0, 0.5), 9, 1e-13);
}

TEST_F(GasLaw, WithoutAVolumeNothingIsFinite) {
  for (const ChamberOptions& options : {relative(1), of_law("isothermal"), of_law("adiabatic")}) {
    const Chambers chambers = gas(options);
    for (const double volume : {0.0, -1.0}) {
      const GasState state = chambers.state(0, volume, 0);
      EXPECT_FALSE(std::isfinite(state.pressure));
      EXPECT_FALSE(std::isfinite(state.pressure_slope));
      EXPECT_FALSE(std::isfinite(state.potential));
    }
  }
}

// --- Tangents ----------------------------------------------------------------------------------------------------

TEST(GasTangent, CompleteTangentIsTheDerivativeOfTheForceForEveryLaw) {
  const Membrane sphere = membrane_of(icosphere_mesh(1, radius));
  Field x = rest_positions(sphere);
  x.values() += 0.1 * radius * scattered(sphere, 1).values();
  const Field w = scattered(sphere, 2);
  ChamberOptions filled = of_law("isothermal");
  filled.amount_ratio = {{0, 2}};
  ChamberOptions prescribed = of_law("pressure");
  prescribed.pressure = {{0, 5e4}};
  for (const ChamberOptions& options : {relative(5e4), filled, of_law("adiabatic"), prescribed}) {
    const Chambers chambers = chambers_of(sphere, {{"air", options}});
    Field moved(sphere.particles, 3);
    const auto force = [&](double s) -> Eigen::Matrix3Xd {
      moved.values() = x.values() + s * w.values();
      return chambers.state(0, chambers.volumes(moved)[0], 0).pressure * chambers.volume_gradient(0, moved);
    };
    const double step = 1e-4 * radius;
    const Eigen::Matrix3Xd difference =
        -(8 * (force(step) - force(-step)) - (force(2 * step) - force(-2 * step))) / (12 * step);
    const GasState state = chambers.state(0, chambers.volumes(x)[0], 0);
    const Eigen::Matrix3Xd exact = gas_stiffness_product(sphere, chambers, x, -state.pressure_slope, state.pressure, w);
    const Eigen::Matrix3Xd error = difference - exact;
    EXPECT_LT(dot(sphere, error, error), 1e-18 * dot(sphere, exact, exact)) << options.law.name();
  }
}

TEST(GasTangent, ThePapersFactorIsRightForDilationAndAThirdOfTheRankOnePart) {
  const Membrane sphere = membrane_of(icosphere_mesh(2, radius));
  const Chambers chambers = chambers_of(sphere, {{"air", relative(7000)}});
  Field x = rest_positions(sphere);
  x.values() *= 1.5;
  const Field& w = x;  // dilation
  const GasState state = chambers.state(0, chambers.volumes(x)[0], 0);
  const Eigen::Matrix3Xd exact = gas_stiffness_product(sphere, chambers, x, -state.pressure_slope, state.pressure, w);
  const Eigen::Matrix3Xd rank1 = gas_stiffness_product(sphere, chambers, x, -state.pressure_slope, 0, w);
  // Eq. 17 with An = 3 dV/dx.
  const Eigen::Matrix3Xd sum_of_areas = 3 * chambers.volume_gradient(0, x);
  const Eigen::Matrix3Xd paper = 7000 * chambers.initial_volume(0) / (27 * state.volume * state.volume) *
                                 dot(sphere, sum_of_areas, w.values()) * sum_of_areas;
  const double scale = dot(sphere, paper, paper);
  const Eigen::Matrix3Xd of_exact = exact - paper;
  const Eigen::Matrix3Xd of_rank1 = rank1 - 3 * paper;
  EXPECT_LT(dot(sphere, of_exact, of_exact), 1e-24 * scale);
  EXPECT_LT(dot(sphere, of_rank1, of_rank1), 1e-24 * scale);
}

// --- Bad input ---------------------------------------------------------------------------------------------------

class BadGas : public TwoSpheres {
 protected:
  void expect_error(const ChamberMap& options, const std::string& words) const {
    try {
      chambers_of(membrane, options);
      ADD_FAILURE() << "no error: " << words;
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()), words);
    }
  }
};

TEST_F(BadGas, KeysThatTheLawDoesNotUse) {
  ChamberOptions options = relative(1);
  options.amount = {{0, 1}};
  expect_error({{"air", options}},
               "chambers.air.amount: given, but the law relative does not use it, expected another law or no such key");
  options = of_law("isothermal");
  options.gamma = 1.3;
  expect_error(
      {{"air", options}},
      "chambers.air.gamma: given, but the law isothermal does not use it, expected another law or no such key");
}

TEST_F(BadGas, KeysThatTheLawLacksOrHasTwice) {
  expect_error({{"air", ChamberOptions()}},
               "chambers.air.pressure: not given, expected key points (time, pressure) with the law relative");
  expect_error({{"air", of_law("volume")}},
               "chambers.air: neither volume nor volume_ratio given, expected one of them");
  ChamberOptions options = of_law("adiabatic");
  options.amount = {{0, 1}};
  options.amount_ratio = {{0, 1}};
  expect_error({{"air", options}}, "chambers.air: both amount and amount_ratio given, expected one of them");
}

TEST_F(BadGas, Values) {
  ChamberOptions options = of_law("isothermal");
  options.temperature = {{0, 300}, {0, 400}};
  expect_error({{"air", options}},
               "chambers.air.temperature: key point 2 is at 0.000000 s, expected later than the one before");
  options.temperature = {{0, 300}, {2.5, -1}};
  expect_error({{"air", options}}, "chambers.air.temperature: -1 at 2.5 s, expected more than 0");
  options = of_law("adiabatic");
  options.temperature = {{0, 300}, {1, 400}};
  expect_error({{"air", options}},
               "chambers.air.temperature: 2 key points, expected one with the law adiabatic: the temperature at the "
               "undeformed volume");
}

TEST_F(BadGas, Pieces) {
  ChamberOptions options = relative(1);
  options.vertex = 99999;
  expect_error({{"air", options}}, "chambers.air.vertex: 99999 is no vertex of the mesh, expected one of it");
  options.vertex = 3;
  ChamberOptions other = relative(1);
  other.vertex = 4;
  expect_error({{"air", options}, {"gas", other}},
               "chambers.gas.vertex: 4 is of the piece that chambers.air names, expected another piece");
  other.vertex = in_second;
  expect_error({{"air", options}, {"gas", other}, {"rest", relative(1)}},
               "chambers.rest: other chambers name all pieces of the mesh, expected a piece for it");
  expect_error({{"air", relative(1)}, {"gas", relative(1)}},
               "chambers.gas.vertex: not given, as for chambers.air, expected one chamber for the pieces that no other "
               "names");
}

TEST_F(BadGas, NoAmountInAVacuum) {
  GasOptions vacuum;
  vacuum.ambient_pressure = 0;
  EXPECT_THROW(Chambers(membrane, vacuum, {{"air", of_law("isothermal")}}, Eigen::Vector3d::Zero(), SymmetryPlanes(),
                        free_to_move(membrane)),
               Error);
}

TEST(BadGasMesh, InsideOut) {
  SurfaceMesh mesh = cube_mesh(2);
  for (auto& face : mesh.faces) {
    std::swap(face[0], face[1]);
  }
  try {
    chambers_of(membrane_of(mesh), {{"air", relative(1)}});
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find("chambers.air: the piece encloses -"), 0) << error.what();
  }
}

}  // namespace
}  // namespace pellicle
