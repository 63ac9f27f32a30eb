// The gas of the balloons (cases B1) of an independent implementation, in the folder that the environment variable
// PELLICLE_REFERENCE names, else in ../shared/reference.

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cstdlib>
#include <filesystem>

#include "gas/chambers.h"
#include "meshing/readers.h"
#include "tests/gas/membranes.h"
#include "tests/support/shared_folder.h"

namespace pellicle {
namespace {

constexpr double tolerance = 1e-9;  // relative

std::vector<std::string> balloons() {
  const char* named = std::getenv("PELLICLE_REFERENCE");
  const auto folder = named != nullptr ? std::filesystem::path(named) : shared_folder() / "reference";
  const std::string ending = ".params.json";
  std::vector<std::string> names;
  std::error_code no_folder;
  for (const auto& entry : std::filesystem::directory_iterator(folder, no_folder)) {
    const std::string path = entry.path().string();
    if (entry.path().filename().string().rfind("B1", 0) == 0 && path.size() > ending.size() &&
        path.compare(path.size() - ending.size(), ending.size(), ending) == 0) {
      names.push_back(path.substr(0, path.size() - ending.size()));
    }
  }
  return names;
}

Field field_of(const Membrane& membrane, const YAML::Node& rows) {
  Field field(membrane.particles, 3);
  for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
    const YAML::Node row = rows[membrane.persistent_id[i]];
    field.vector(i) = Eigen::Vector3d(row[0].as<double>(), row[1].as<double>(), row[2].as<double>());
  }
  return field;
}

class ReferenceGas : public ::testing::Test {
 protected:
  void SetUp() override {
    if (balloons().empty()) {
      GTEST_SKIP() << "no reference cases of balloons";
    }
  }
};

TEST_F(ReferenceGas, VolumesPressuresForceAndTangents) {
  for (const std::string& name : balloons()) {
    SCOPED_TRACE(name);
    const YAML::Node params = YAML::LoadFile(name + ".params.json");
    const YAML::Node expected = YAML::LoadFile(name + ".expected.json")["gas"];
    const Membrane membrane = membrane_of(read_mesh(name + ".obj"));
    const Field x = field_of(membrane, params["x"]);
    const Field w = field_of(membrane, params["w"]);

    ChamberOptions relative;
    relative.pressure = {{0, params["gas"]["p0"].as<double>()}};
    GasOptions gas;
    gas.ambient_pressure = params["gas_ambient"]["p_amb"].as<double>();
    ChamberOptions filled;
    filled.law = "isothermal";
    filled.amount_ratio = {{0, 1 + params["gas_ambient"]["p_add"].as<double>() / gas.ambient_pressure}};
    const Chambers chambers(membrane, gas, {{"air", relative}}, Eigen::Vector3d::Zero(), {}, free_to_move(membrane));
    const Chambers pumped(membrane, gas, {{"air", filled}}, Eigen::Vector3d::Zero(), {}, free_to_move(membrane));

    const auto expect_near = [](double value, const YAML::Node& wanted) {
      EXPECT_NEAR(value, wanted.as<double>(), tolerance * std::abs(wanted.as<double>()));
    };
    const GasState state = chambers.state(0, chambers.volumes(x)[0], 0);
    expect_near(chambers.initial_volume(0), expected["V0"]);
    expect_near(state.volume, expected["V"]);
    expect_near(state.pressure, expected["p"]);
    expect_near(pumped.state(0, state.volume, 0).pressure, expected["p_ambient"]);

    const auto expect_field = [&](const Eigen::Matrix3Xd& value, const std::string& key) {
      const Field wanted = field_of(membrane, expected[key]);
      const Eigen::MatrixXd error = value - wanted.values().leftCols(value.cols());
      EXPECT_LT(std::sqrt(dot(membrane, error, error)),
                tolerance * std::sqrt(dot(membrane, wanted.values(), wanted.values())))
          << key;
    };
    const auto product = [&](double factor, double pressure) {
      return gas_stiffness_product(membrane, chambers, x, factor, pressure, w);
    };
    expect_field(state.pressure * chambers.volume_gradient(0, x), "f");
    expect_field(product(-state.pressure_slope / 3, 0), "Kw_paper");
    expect_field(product(-state.pressure_slope, 0), "Kw_rank1");
    expect_field(product(-state.pressure_slope, state.pressure), "Kw_exact");
  }
}

}  // namespace
}  // namespace pellicle
