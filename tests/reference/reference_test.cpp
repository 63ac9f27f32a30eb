// Compares with the cases of independent implementations: our own in tests/reference/cases, and every case in the
// folder that the environment variable PELLICLE_REFERENCE names, else in ../shared/reference. NAME.obj is the mesh,
// NAME.params.json the input, NAME.expected.json the result (JSON is YAML). A0: projections; A1: a run of burning
// steps, A3: with ablation. Balloons (B1): balloon_reference_test.cpp. Other kinds are skipped.

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "ablation/ablation.h"
#include "ablation/cut_surface.h"
#include "heat/diffusion_graph.h"
#include "heat/heat_balance.h"
#include "meshing/readers.h"
#include "surface/shell.h"
#include "tests/reference/reference_cases.h"
#include "tests/support/alone.h"

namespace pellicle {
namespace {

TEST(Reference, CasesAreThere) {
  EXPECT_GE(cases_of("A1").size(), 1U) << "no cases in " << own_cases();
  EXPECT_GE(cases_of("A3").size(), 1U) << "no cases in " << own_cases();
  if (!std::filesystem::exists(reference_folder())) {
    GTEST_SKIP() << "no further cases at " << reference_folder();
  }
  EXPECT_FALSE(cases_of("A0").empty() || cases_of("B").empty()) << "no cases in " << reference_folder();
}

constexpr const char* letters = "RGBY";

/// One case: mesh, sheet and the reference's own order of springs.
class Case {
 public:
  explicit Case(const std::string& base) {
    params = YAML::LoadFile(base + ".params.json");
    expected = YAML::LoadFile(base + ".expected.json");
    mesh = read_mesh(base + ".obj");
    options.thickness = params["thickness"].as<double>();
    options.areal_density = params["areal_density"].as<double>();
    sheet = make_sheet(PETSC_COMM_WORLD, mesh, options);
    number_springs();
  }

  YAML::Node params;
  YAML::Node expected;
  SurfaceMesh mesh;
  SheetOptions options;
  Sheet sheet;
  std::array<std::vector<std::size_t>, 4> number;  ///< in the reference of each local spring

  std::vector<double> particle_masses() const { return sheet.initial_mass; }

  /// Values of a list by the reference's number of a local spring.
  std::array<std::vector<double>, 4> spring_values(const YAML::Node& by_letter) const {
    std::array<std::vector<double>, 4> result;
    for (std::size_t colour = 0; colour < 4; ++colour) {
      const auto all = by_letter[std::string(1, letters[colour])].as<std::vector<double>>();
      for (const std::size_t index : number[colour]) {
        result[colour].push_back(all.at(index));
      }
    }
    return result;
  }

  /// Sets a field on all local particles from a list in the order of persistent ids.
  void set(Field& field, const YAML::Node& list) const {
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      const YAML::Node row = list[sheet.persistent_id[i]];
      for (int c = 0; c < field.components(); ++c) {
        field.values()(c, i) = field.components() == 1 ? row.as<double>() : row[c].as<double>();
      }
    }
  }

  /// Expects a field, ghosts too, to equal a list in the order of persistent ids.
  void expect(const Field& field, const YAML::Node& list, const std::string& what) const {
    Field wanted(sheet.particles, field.components());
    set(wanted, list);
    double scale = wanted.values().size() > 0 ? wanted.values().cwiseAbs().maxCoeff() : 0;
    MPI_Allreduce(MPI_IN_PLACE, &scale, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
    const double difference = wanted.values().size() > 0 ? (field.values() - wanted.values()).cwiseAbs().maxCoeff() : 0;
    EXPECT_LE(difference, tolerance * scale) << what;
  }

 private:
  void number_springs() {
    using Pair = std::pair<int, int>;
    const auto pair = [](int a, int b) { return Pair(std::min(a, b), std::max(a, b)); };
    const auto corners = static_cast<int>(mesh.points.size());
    std::array<std::vector<Pair>, 4> order;
    std::vector<Pair> edges;
    std::map<Pair, std::vector<int>> cells_of_edge;
    for (int cell = 0; cell < static_cast<int>(mesh.faces.size()); ++cell) {
      const auto& q = mesh.faces[cell];
      for (std::size_t k = 0; k < 4; ++k) {
        order[0].push_back(pair(q[k], corners + cell));
        auto& cells = cells_of_edge[pair(q[k], q[(k + 1) % 4])];
        if (cells.empty()) {
          edges.push_back(pair(q[k], q[(k + 1) % 4]));
        }
        cells.push_back(cell);
      }
      order[3].push_back(pair(q[0], q[2]));
      order[3].push_back(pair(q[1], q[3]));
    }
    for (const Pair& edge : edges) {
      order[2].push_back(edge);
      const auto& cells = cells_of_edge[edge];
      if (cells.size() == 2) {
        order[1].push_back(pair(corners + cells[0], corners + cells[1]));
      }
    }
    for (std::size_t colour = 0; colour < 4; ++colour) {
      std::map<Pair, std::size_t> index;
      for (std::size_t s = 0; s < order[colour].size(); ++s) {
        index[order[colour][s]] = s;
      }
      ASSERT_EQ(static_cast<std::size_t>(sheet.springs[colour].layout.global), order[colour].size());
      for (const auto& [a, b] : sheet.springs[colour].ends) {
        number[colour].push_back(index.at(pair(sheet.persistent_id[a], sheet.persistent_id[b])));
      }
    }
  }
};

ProjectOptions direct_solves() {
  ProjectOptions options;
  options.masses = "equal";
  options.ksp_rtol = 1e-13;
  options.shift = 0;
  options.threshold = 0;
  return options;
}

class ReferenceProjection : public ::testing::TestWithParam<std::string> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ReferenceProjection);
INSTANTIATE_TEST_SUITE_P(A0, ReferenceProjection, ::testing::ValuesIn(cases_of("A0")));

TEST_P(ReferenceProjection, Agrees) {
  const Case c(GetParam());
  const auto lengths = c.spring_values(c.params["target_lengths"]);
  const std::vector<double> mass = c.particle_masses();
  const std::vector<bool> free(c.sheet.particles.local(), false);
  const ActiveSet active(c.sheet);
  const ProjectionInput input{lengths, mass, free, active};
  Field x(c.sheet.particles, 3);
  SuccessiveProjection plain(c.sheet, direct_solves());

  c.set(x, c.params["x0"]);
  const ProjectionError before = plain.errors(x, input);
  const double all = c.expected["errors_before"]["all"].as<double>();
  EXPECT_NEAR(before.total, all, tolerance * all);
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    const std::string letter(1, letters[index]);
    const auto error = c.expected["errors_before"][letter].as<double>();
    EXPECT_NEAR(before.colour[index], error, tolerance * error);

    c.set(x, c.params["x0"]);
    const YAML::Node single = c.expected["single_" + letter];
    Linearisation constraint;
    linearise(c.sheet.of(colour), x.data(), lengths[index], active.springs[index], constraint);
    const auto errors = single["C"].as<std::vector<double>>();
    for (PetscInt s = 0; s < c.sheet.of(colour).owned(); ++s) {
      EXPECT_NEAR(constraint.error[s], errors.at(c.number[index][s]), tolerance * error);
    }
    EXPECT_TRUE(plain.project(x, colour, input).converged);
    c.expect(x, single["x"], "single_" + letter);
  }

  // successiveN[_wDD][_regDD][_pins_exact|paper_ID...]: N full steps; 05 stands for 0.5.
  for (const auto& entry : c.expected) {
    const auto name = entry.first.as<std::string>();
    if (name.rfind("successive", 0) != 0) {
      continue;
    }
    ProjectOptions options = direct_solves();
    options.monitor = true;
    options.max_steps = std::stoi(name.substr(10));
    std::vector<bool> pinned = free;
    bool in_pins = false;
    std::stringstream words(
        name.substr(name.find_first_not_of("0123456789", 10) == std::string::npos ? name.size() : name.find('_') + 1));
    for (std::string word; std::getline(words, word, '_');) {
      const auto fraction = [&word](std::size_t skip) { return std::stod("0." + word.substr(skip + 1)); };
      if (word == "pins") {
        in_pins = true;
      } else if (word == "exact" || word == "paper") {
        options.pins = word;
      } else if (word.rfind("reg", 0) == 0) {
        options.shift = fraction(3);
      } else if (word.rfind('w', 0) == 0) {
        options.weight.fill(fraction(1));
      } else if (in_pins) {
        for (PetscInt i = 0; i < c.sheet.particles.local(); ++i) {
          if (c.sheet.persistent_id[i] == std::stoi(word)) {
            pinned[i] = true;
          }
        }
      } else {
        FAIL() << "what does '" << word << "' mean in " << name << "?";
      }
    }
    SuccessiveProjection projection(c.sheet, options);
    c.set(x, c.params["x0"]);
    EXPECT_TRUE(projection.advance(x, {lengths, mass, pinned, active}).converged);
    c.expect(x, entry.second["x"], name);
    if (const YAML::Node totals = entry.second["substep_total_error"]) {
      ASSERT_EQ(projection.monitored().size(), totals.size() + 1);
      for (std::size_t step = 0; step < totals.size(); ++step) {
        EXPECT_NEAR(projection.monitored()[step + 1].total, totals[step].as<double>(), tolerance * all) << name;
      }
    }
  }
}

Eigen::Vector3d vector_of(const YAML::Node& node) {
  return {node[0].as<double>(), node[1].as<double>(), node[2].as<double>()};
}

/// Spheres and planes of a case: maps such as {centre, radius} and {point, normal} or {normal, offset}, or lists
/// [centre, radius] and [point, normal]. A key that this test does not know fails.
void add_bodies(const YAML::Node& list, const std::string& shape, std::map<std::string, BodyOptions>& bodies) {
  for (const YAML::Node& node : list) {
    BodyOptions body;
    body.shape = shape;
    std::optional<double> offset;
    if (node.IsSequence() && shape == "sphere") {
      body.centre = vector_of(node[0]);
      body.radius = node[1].as<double>();
    } else if (node.IsSequence()) {
      body.point = vector_of(node[0]);
      body.normal = vector_of(node[1]);
    } else {
      for (const auto& entry : node) {
        const auto key = entry.first.as<std::string>();
        const YAML::Node value = entry.second;
        if (key == "centre" || key == "center") {
          body.centre = vector_of(value);
        } else if (key == "radius") {
          body.radius = value.as<double>();
        } else if (key == "point") {
          body.point = vector_of(value);
        } else if (key == "normal") {
          body.normal = vector_of(value);
        } else if (key == "offset") {
          offset = value.as<double>();
        } else if (key == "velocity") {
          body.velocity = vector_of(value);
        } else if (key == "friction") {
          body.friction = value.as<double>();
        } else {
          FAIL() << shape << ": unknown key " << key;
        }
      }
    }
    if (offset) {
      body.point = *offset * body.normal / body.normal.squaredNorm();
    }
    bodies[shape + std::to_string(bodies.size())] = body;
  }
}

Options options_of(const Case& c) {
  const YAML::Node params = c.params["params"];
  Options options;
  options.sheet = c.options;
  options.dynamics = Dynamics::projection;
  options.project = direct_solves();
  // The reference damps what gravity adds in a step, too: v e^{-ch} + h g e^{-ch}, here v e^{-ch} + h g (1 -
  // e^{-ch})/(ch).
  options.force.damping = params["damping"].as<double>();
  const double fading = *options.force.damping * params["h"].as<double>();
  options.force.gravity = std::exp(-fading) * fading / -std::expm1(-fading) * vector_of(params["gravity"]);
  options.heat.operator_name = "umbrella";
  options.heat.ksp_rtol = 1e-14;
  options.heat.diffusivity = params["alpha"].as<double>();
  options.heat.burning_heat = params["eta"].as<double>();
  int balls = 0;
  for (const YAML::Node& ball : params["balls"]) {
    HeatSource source;
    source.centre = vector_of(ball["centre"]);
    source.velocity = vector_of(ball["velocity"]);
    source.radius = ball["radius"].as<double>();
    source.temperature = ball["T"].as<double>();
    source.rate = ball["rate"].as<double>();
    options.heat.sources["ball" + std::to_string(balls++)] = source;
  }
  options.combustion.ignition_temperature = params["T_ignition"].as<double>();
  options.combustion.mass_loss_rate = params["mu"].as<double>();
  options.combustion.min_mass = params["m_min"].as<double>();
  options.ablation.spring_rule = "triangles";
  if (const YAML::Node loss_mass = params["m_loss"]) {
    options.ablation.loss_mass = loss_mass.as<double>();
  }
  options.combustion.burnt_density = params["rho_ratio"].as<double>() * options.combustion.initial_density;
  options.combustion.corner_factor = params["layer_mu"][0].as<double>();
  options.combustion.lattice_factor = params["layer_mu"][1].as<double>();
  options.project.max_steps = params["max_iter"].as<int>();
  options.project.threshold = params["threshold"].as<double>();
  options.project.order = params["order"].as<std::string>();
  options.project.pins = params["pins"].as<std::string>();
  options.project.masses = params["mass_weighted"].as<bool>() ? "true" : "equal";
  options.project.shift = params["reg"].as<double>();
  for (std::size_t colour = 0; colour < 4; ++colour) {
    if (const YAML::Node weight = params["weights"][std::string(1, letters[colour])]) {
      options.project.weight[colour] = weight.as<double>();
    }
  }
  for (const YAML::Node& node : params["fixed"]) {  // where the case has them at the start
    const int id = node.as<int>();
    const Eigen::Vector3d moved = vector_of(c.params["x0"][id]) - c.mesh.points.at(id);
    PinOptions& pin = options.pins["fixed" + std::to_string(id)];
    pin.vertices = {id};
    pin.path = {{0, moved.x(), moved.y(), moved.z()}};
  }
  add_bodies(params["spheres"], "sphere", options.bodies);
  add_bodies(params["planes"], "plane", options.bodies);
  return options;
}

class ReferenceBurning : public ::testing::TestWithParam<std::string> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ReferenceBurning);
INSTANTIATE_TEST_SUITE_P(A1, ReferenceBurning, ::testing::ValuesIn(cases_of("A1")));
INSTANTIATE_TEST_SUITE_P(A3, ReferenceBurning, ::testing::ValuesIn(cases_of("A3")));

/// Numbers of dead springs.
void expect_dead_springs(const Case& c, const ActiveSet& active) {
  for (std::size_t colour = 0; colour < 4; ++colour) {
    const std::string letter(1, letters[colour]);
    const YAML::Node numbers = c.expected["dead_springs"][letter];
    std::set<std::size_t> expected;
    for (const YAML::Node& number : numbers) {
      expected.insert(number.as<std::size_t>());
    }
    const SpringSet& springs = c.sheet.springs[colour];
    int alive = 0;
    for (std::size_t s = 0; s < springs.ends.size(); ++s) {
      const bool lives = active.springs[colour][s];
      alive += lives && s < static_cast<std::size_t>(springs.owned()) ? 1 : 0;
      EXPECT_EQ(lives, expected.count(c.number[colour][s]) == 0) << letter << " " << c.number[colour][s];
    }
    MPI_Allreduce(MPI_IN_PLACE, &alive, 1, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
    EXPECT_EQ(alive, c.expected["alive_count"][letter].as<int>()) << letter;
  }
}

/// The surface that is left, cut by marching triangles.
void expect_cut(const Case& c, const State& state, const Options& options) {
  const DrawnSurface surface =
      cut_surface(c.sheet, state.burning->active, level_set(c.sheet, state.burning->mass, options.ablation.loss_mass));
  std::array<double, 2> sums{static_cast<double>(surface.triangles.size()), 0};  // and area
  const auto place = [&](PetscInt number) {
    const DrawnPoint& point = surface.points[number];
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      sum += point.weights[k] * state.position.vector(point.particles[k]);
    }
    return sum;
  };
  for (const auto& [p, q, r] : surface.triangles) {
    sums[1] += (place(q) - place(p)).cross(place(r) - place(p)).norm() / 2;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_EQ(sums[0], c.expected["cut_triangles"].as<double>());
  const auto area = c.expected["cut_area"].as<double>();
  EXPECT_NEAR(sums[1], area, tolerance * area);
}

TEST_P(ReferenceBurning, Agrees) {
  const Case c(GetParam());
  const Sheet& sheet = c.sheet;
  const Options options = options_of(c);

  // Figures of the shell itself.
  EXPECT_EQ(sheet.particles.global, c.expected["n_particles"].as<int>());
  for (const Colour colour : all_colours) {
    const std::string letter(1, letters[static_cast<std::size_t>(colour)]);
    const SpringSet& springs = sheet.of(colour);
    EXPECT_EQ(springs.layout.global, c.expected["n_springs"][letter].as<int>());
    double sum = 0;
    for (PetscInt s = 0; s < springs.owned(); ++s) {
      sum += springs.initial_length[s];
    }
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    EXPECT_NEAR(sum, c.expected["l0_sum"][letter].as<double>(), tolerance * sum);
  }
  Field initial_mass(sheet.particles, 1);
  initial_mass.values() = Eigen::Map<const Eigen::RowVectorXd>(sheet.initial_mass.data(), sheet.particles.local());
  c.expect(initial_mass, c.expected["m0"], "m0");

  // The umbrella (eq. 3) at x0: E and L of (T/1000)^2.
  Field x0(sheet.particles, 3);
  Field temperature(sheet.particles, 1);
  c.set(x0, c.params["x0"]);
  c.set(temperature, c.params["T0"]);
  DiffusionGraph graph;
  graph.pairs = umbrella_pairs(sheet);
  set_umbrella(graph, sheet, std::vector<double>(static_cast<std::size_t>(sheet.particles.local()), 1.0), x0,
               ActiveSet(sheet));
  Field squared(sheet.particles, 1);
  squared.values() = (temperature.values() / 1000).array().square();
  Eigen::VectorXd inflow;
  graph.add_up_inflow(squared, inflow);
  Field lengths(sheet.particles, 1);
  Field laplacian(sheet.particles, 1);
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    lengths.values()(0, i) = 2 * graph.capacity[i];
    laplacian.values()(0, i) = inflow[i] / graph.capacity[i];
  }
  lengths.update_ghosts();
  laplacian.update_ghosts();
  c.expect(lengths, c.expected["umbrella_E"], "umbrella_E");
  c.expect(laplacian, c.expected["umbrella_L_of_T2"], "umbrella_L_of_T2");

  Alone burning(c.mesh, options);
  ASSERT_EQ(burning.sheet().persistent_id, sheet.persistent_id) << "numbers its particles in another way";
  State& state = burning.state();
  BurningFields& fields = burning.burning();
  c.set(state.position, c.params["x0"]);
  c.set(state.velocity, c.params["v0"]);
  c.set(fields.temperature, c.params["T0"]);
  fields.heat_initial = heat_content(sheet, fields.mass, fields.temperature, options.heat.capacity);
  const double h = c.params["params"]["h"].as<double>();
  for (const YAML::Node& figures : c.expected["per_step"]) {
    const AloneStep step = burning.advance(h);
    ASSERT_TRUE(step.converged) << step.reason;
    const auto error = figures["err"].as<double>();
    EXPECT_NEAR(step.constraint_error, error, tolerance * std::max(error, 1e-3)) << "step " << state.step;
  }
  EXPECT_EQ(state.step, c.params["steps"].as<int>());
  c.expect(state.position, c.expected["x"], "x");
  c.expect(state.velocity, c.expected["v"], "v");
  c.expect(fields.temperature, c.expected["T"], "T");
  c.expect(fields.mass, c.expected["m"], "m");
  const auto target = c.spring_values(c.expected["target_lengths"]);
  for (std::size_t colour = 0; colour < 4; ++colour) {
    for (std::size_t s = 0; s < target[colour].size(); ++s) {
      EXPECT_NEAR(state.target_length[colour][s], target[colour][s], tolerance);
    }
  }
  if (c.expected["dead_springs"]) {
    expect_dead_springs(c, fields.active);
  }
  if (c.expected["cut_area"]) {
    expect_cut(c, state, options);
  }
}

}  // namespace
}  // namespace pellicle
