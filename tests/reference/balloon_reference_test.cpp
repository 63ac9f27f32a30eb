// Compares with the balloons (B1) of an independent implementation, see reference_cases.h.

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "base/error.h"
#include "meshing/readers.h"
#include "prism/volume_preservation.h"
#include "prism/wall_potential.h"
#include "surface/membrane.h"
#include "tests/reference/reference_cases.h"
#include "tests/support/alone.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

/// One case: mesh, membrane, and lists by persistent id.
class BalloonCase {
 public:
  explicit BalloonCase(const std::string& base) {
    params = YAML::LoadFile(base + ".params.json");
    expected = YAML::LoadFile(base + ".expected.json");
    mesh = read_mesh(base + ".obj");
    membrane = make_membrane(PETSC_COMM_WORLD, mesh, {});
  }

  YAML::Node params;
  YAML::Node expected;
  SurfaceMesh mesh;
  Membrane membrane;

  /// A vector field on the local vertices from a list.
  Field field(const YAML::Node& list) const {
    Field result(membrane.particles, 3);
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      result.vector(i) = vector(list[membrane.persistent_id[i]]);
    }
    return result;
  }

  static Eigen::Vector3d vector(const YAML::Node& row) {
    return {row[0].as<double>(), row[1].as<double>(), row[2].as<double>()};
  }

  /// Expects vectors of the owned vertices to equal a list.
  void expect(const Eigen::Ref<const Eigen::Matrix3Xd>& found, const YAML::Node& list, const std::string& what) const {
    double worst = 0;
    for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
      const Eigen::Vector3d wanted = vector(list[membrane.persistent_id[i]]);
      worst = std::max(worst, (found.col(i) - wanted).cwiseAbs().maxCoeff());
    }
    double scale = 0;
    for (const YAML::Node& row : list) {
      scale = std::max(scale, vector(row).cwiseAbs().maxCoeff());
    }
    EXPECT_LE(worst, tolerance * scale) << what;
  }

  double sum(double value) const {
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return value;
  }

  /// The wall of one of the case's materials. `nh` is neo-Hookean in plane stress and incompressible.
  WallOptions wall_options(const std::string& material) const {
    const YAML::Node constants = params["materials"][material];
    WallOptions options;
    const bool is_neo_hookean = constants["material"].as<std::string>() == "nh";
    options.thickness_rule = is_neo_hookean ? "incompressible" : "fixed";
    options.material.law = is_neo_hookean ? "neo_hookean" : "st_venant_kirchhoff";
    options.material.mu = constants["mu"].as<double>();
    options.material.lambda = constants["lam"].as<double>();
    options.thickness = params["h0"].as<double>();
    options.density = params["rho"].as<double>();
    return options;
  }
};

class ReferenceBalloon : public ::testing::TestWithParam<std::string> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ReferenceBalloon);
INSTANTIATE_TEST_SUITE_P(B1, ReferenceBalloon, ::testing::ValuesIn(cases_of("B1")));

TEST_P(ReferenceBalloon, Elements) {
  const BalloonCase c(GetParam());
  const Field x = c.field(c.params["x"]);
  const Field w = c.field(c.params["w"]);
  const std::vector<double> ratio(c.membrane.triangles.size(), c.params["h_ratio"].as<double>());
  const Projectors free(c.membrane.persistent_id.size());
  for (const auto& entry : c.params["materials"]) {
    const auto name = entry.first.as<std::string>();
    const YAML::Node expected = c.expected[name];
    const Wall wall = make_wall(c.membrane, c.wall_options(name), {});
    const PrismElements elements(c.membrane, wall);
    const double energy = expected["energy"].as<double>();
    EXPECT_NEAR(c.sum(elements.energy(x, ratio)), energy, tolerance * energy) << name;
    Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, c.membrane.particles.owned);
    elements.add_gradient(x, ratio, gradient);
    c.expect(-gradient, expected["f"], name + " force");
    for (const bool positive : {false, true}) {
      for (const char* type : {"baij", "shell"}) {
        PrismOptions options;
        options.positive_elements = positive;
        options.mat_type = type;
        WallPotential potential(elements, options);
        potential.set_thickness(ratio);
        Tangent tangent(c.membrane.particles, {&potential}, free, options.mat_type, "prism_");
        tangent.update(x, Curvature::exact);
        VecHandle in;
        VecHandle out;
        check(MatCreateVecs(tangent.matrix(), in.create(), out.create()));
        double* values = nullptr;
        check(VecGetArray(in, &values));
        std::copy_n(w.data(), 3 * c.membrane.particles.owned, values);
        check(VecRestoreArray(in, &values));
        check(MatMult(tangent.matrix(), in, out));
        const double* product = nullptr;
        check(VecGetArrayRead(out, &product));
        c.expect(Eigen::Map<const Eigen::Matrix3Xd>(product, 3, c.membrane.particles.owned),
                 expected[positive ? "Kw_spd" : "Kw"], name + " " + type + (positive ? " K w, positive" : " K w"));
        check(VecRestoreArrayRead(out, &product));
      }
    }
  }
  const Wall wall = make_wall(c.membrane, c.wall_options("nh"), {});
  const std::vector<double> mass = vertex_masses(c.membrane, wall);
  for (PetscInt i = 0; i < c.membrane.particles.owned; ++i) {
    const double wanted = c.expected["mass"][c.membrane.persistent_id[i]].as<double>();
    EXPECT_NEAR(mass[i], wanted, tolerance * wanted);
  }
}

/// The chamber of a case: the paper's gas, or one filled against ambient pressure.
Chambers chamber_of(const BalloonCase& c, const YAML::Node& gas) {
  GasOptions options;
  ChamberOptions chamber;
  if (gas["mode"].as<std::string>() == "paper") {
    chamber.pressure = {{0, gas["p0"].as<double>()}};
  } else {
    options.ambient_pressure = gas["p_amb"].as<double>();
    chamber.law = "isothermal";
    chamber.amount_ratio = {{0, 1 + gas["p_add"].as<double>() / options.ambient_pressure}};
  }
  return {c.membrane,
          options,
          {{"gas", chamber}},
          Eigen::Vector3d::Zero(),
          {},
          Projectors(c.membrane.persistent_id.size())};
}

TEST_P(ReferenceBalloon, Gas) {
  const BalloonCase c(GetParam());
  const YAML::Node expected = c.expected["gas"];
  const Field x = c.field(c.params["x"]);
  const Chambers paper = chamber_of(c, c.params["gas"]);
  const double volume = paper.volumes(x)[0];
  EXPECT_NEAR(paper.initial_volume(0), expected["V0"].as<double>(), tolerance * volume);
  EXPECT_NEAR(volume, expected["V"].as<double>(), tolerance * volume);
  const GasState gas = paper.state(0, volume, 0);
  EXPECT_NEAR(gas.pressure, expected["p"].as<double>(), tolerance * gas.pressure);
  const double against_ambient = chamber_of(c, c.params["gas_ambient"]).state(0, volume, 0).pressure;
  EXPECT_NEAR(against_ambient, expected["p_ambient"].as<double>(), tolerance * against_ambient);
  const Eigen::Matrix3Xd gradient = paper.volume_gradient(0, x);
  c.expect(gas.pressure * gradient, expected["f"], "pressure force");
  const Field w = c.field(c.params["w"]);
  const double product = c.sum(gradient.cwiseProduct(w.values().leftCols(gradient.cols())).sum());
  c.expect(-gas.pressure_slope * product * gradient, expected["Kw_rank1"], "rank-one tangent");
  c.expect(-gas.pressure_slope / 3 * product * gradient, expected["Kw_paper"], "the paper's tangent");
}

TEST_P(ReferenceBalloon, VolumePreservation) {
  const BalloonCase c(GetParam());
  const YAML::Node expected = c.expected["shell"];
  const Wall wall = make_wall(c.membrane, c.wall_options("stvk"), {});
  const Projectors free(c.membrane.persistent_id.size());
  for (const char* rule : {"mass", "muller06"}) {
    VolumeOptions options;
    options.rule = rule;
    options.max_iterations = 1;
    Field x = c.field(c.params["x"]);
    std::vector<double> ratio(c.membrane.triangles.size(), 1.0);
    const StageResult result = VolumePreservation(c.membrane, wall, free, options).advance(x, ratio);
    c.expect(x.values().leftCols(c.membrane.particles.owned), expected[rule]["x"], rule);
    EXPECT_NEAR(result.error, std::abs(expected[rule]["C_rel"][1].as<double>()), tolerance) << rule;
    for (std::size_t e = 0; e < ratio.size(); ++e) {
      const double wanted = expected[rule]["h"][c.membrane.element_id[e]].as<double>();
      EXPECT_NEAR(ratio[e] * wall.thickness[e], wanted, tolerance * wanted) << rule;
    }
  }
}

TEST_P(ReferenceBalloon, Runs) {
  // The reference solves directly whatever the tangent is like; without its positive part it may be indefinite.
  SolverOptions general;
  general.set("prism_ksp_type", "gmres");
  general.set("prism_ksp_gmres_restart", "300");
  general.set("prism_pc_type", "pbjacobi");
  const BalloonCase c(GetParam());
  for (const auto& entry : c.params["runs"]) {
    const auto name = entry.first.as<std::string>();
    const YAML::Node run = entry.second;
    const YAML::Node expected = c.expected[name];
    const double h = run["dt"].as<double>();
    Options options;
    options.wall = c.wall_options(run["material"].as<std::string>());
    options.wall.bending = "none";  // the reference is of membranes
    if (run["thickness"].as<std::string>() == "algorithm2") {
      options.wall.thickness_rule = "global";
      options.volume.max_iterations = 1;
    }
    options.force.gravity.setZero();
    options.gas.tangent = run["gas_kind"].as<std::string>();
    options.chambers["gas"].pressure = {{0, 0}, {run["ramp_steps"].as<double>() * h, run["p0"].as<double>()}};
    options.prism.newton = "fixed";
    options.prism.max_iterations = run["newton"].as<int>();
    options.prism.snes_rtol = 1e-15;
    options.prism.ksp_rtol = 1e-13;
    options.prism.positive_elements = run["spd"].as<bool>();
    options.prism.line_search = run["line_search"].as<bool>();
    options.prism.mass_damping = run["damping"].as<double>();
    Alone balloon(c.mesh, options, ChainKind::inflate);
    ASSERT_EQ(balloon.membrane().persistent_id, c.membrane.persistent_id) << "numbers its vertices in another way";
    const State& state = balloon.state();
    for (int step = 0; step < run["steps"].as<int>(); ++step) {
      const AloneStep result = balloon.advance(h);
      ASSERT_TRUE(result.converged) << name << ": " << result.reason;
      const double volume = expected["gas_volume"][step].as<double>();
      EXPECT_NEAR(balloon.chambers().volumes(state.position)[0], volume, tolerance * volume) << name;
    }
    c.expect(state.position.values().leftCols(c.membrane.particles.owned), expected["x"], name + " x");
    c.expect(state.velocity.values().leftCols(c.membrane.particles.owned), expected["v"], name + " v");
    if (options.wall.thickness_rule == WallThickness::global_volume) {
      for (std::size_t e = 0; e < c.membrane.triangles.size(); ++e) {
        const double wanted = expected["h"][c.membrane.element_id[e]].as<double>();
        EXPECT_NEAR(state.thickness_ratio[e] * options.wall.thickness, wanted, tolerance * wanted) << name;
      }
    }
  }
}

}  // namespace
}  // namespace pellicle
