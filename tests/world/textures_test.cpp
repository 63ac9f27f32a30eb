// What each texture of a deck does to the chain that reads it: its sense, both ends of its range, and where it is read.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "heat/heat_balance.h"
#include "io/texture.h"
#include "meshing/closed_shapes.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/picture.h"
#include "tests/support/solver_options.h"
#include "tests/world/static_balloon.h"

namespace pellicle::textures_test {
namespace {

constexpr double edge = 0.1;  // [m]
constexpr double h = 2e-3;    // [s]

/// A sheet at rest without gravity.
struct RestingSheet : Alone {
  RestingSheet(const SurfaceMesh& mesh, const Options& options, MPI_Comm comm = PETSC_COMM_WORLD)
      : Alone(mesh, options, ChainKind::burn, comm) {}

  void step() {
    const AloneStep result = advance(h);
    ASSERT_TRUE(result.converged) << result.reason;
  }

  /// Brightness of the picture at a local particle of a sheet of nx x ny cells.
  double bright(PetscInt i, int nx, int ny) const {
    return brightness(surface().rest(0, i) / (nx * edge), surface().rest(1, i) / (ny * edge));
  }
};

Options options_at_rest() {
  Options options;
  options.dynamics = Dynamics::projection;
  options.sheet.thickness = edge / 2;
  options.force.gravity.setZero();
  options.heat.diffusivity = 0;
  options.heat.burning_heat = 0;
  options.project.ksp_rtol = 1e-13;
  return options;
}

TEST(TexturesOfASheet, MassLossFollowsBrightnessBetweenTheEndsOfItsRange) {
  const TestFolder folder;
  Options options = options_at_rest();
  options.heat.initial_temperature = 700;
  options.combustion.mass_loss_texture = write_picture(folder);
  options.combustion.mass_loss_range = {0.3, 2};
  options.combustion.mass_loss_rate = 0.05;
  RestingSheet sheet(grid_mesh(4, 3, edge), options);
  sheet.step();
  for (PetscInt i = 0; i < sheet.surface().particles.local(); ++i) {
    const double initial = sheet.surface().initial_mass[i];
    const double factor = 0.3 + 1.7 * sheet.bright(i, 4, 3);
    EXPECT_NEAR(sheet.burning().mass_change.data()[i], -0.05 * h * 200 * factor * initial, 1e-12 * initial) << i;
  }
}

TEST(TexturesOfASheet, ASourceHeatsWhereItsPictureIsBright) {
  const TestFolder folder;
  Options options = options_at_rest();
  HeatSource& source = options.heat.sources["iron"];
  source.shape = "texture";
  source.file = write_picture(folder);
  source.temperature = 450;
  source.rate = 100;
  RestingSheet sheet(grid_mesh(4, 3, edge), options);
  sheet.step();
  for (PetscInt i = 0; i < sheet.surface().particles.local(); ++i) {
    const double rise = (450 - 300) * (1 - std::exp(-100 * h * sheet.bright(i, 4, 3)));
    EXPECT_NEAR(sheet.burning().temperature.data()[i], 300 + rise, 1e-9) << i;
  }
}

/// Adds the edge between two unknowns to a system that conducts.
void join(Eigen::MatrixXd& matrix, PetscInt a, PetscInt b, double weight) {
  matrix(a, a) += weight;
  matrix(b, b) += weight;
  matrix(a, b) -= weight;
  matrix(b, a) -= weight;
}

/// Temperatures after a backward Euler step of the umbrella as printed: row i is 2/E_i sum_j alpha (T_j - T_i)/d_ij,
/// with the mean alpha of both ends.
Eigen::VectorXd umbrella_step(const Sheet& sheet, const Eigen::VectorXd& alpha, const Eigen::VectorXd& before) {
  Eigen::MatrixXd conduction = Eigen::MatrixXd::Zero(before.size(), before.size());
  Eigen::VectorXd sum_of_lengths = Eigen::VectorXd::Zero(before.size());
  for (const SpringSet& set : sheet.springs) {
    for (const auto& [a, b] : set.ends) {
      const double d = (sheet.rest.col(a) - sheet.rest.col(b)).norm();
      join(conduction, a, b, (alpha[a] + alpha[b]) / 2 / d);
      sum_of_lengths[a] += d;
      sum_of_lengths[b] += d;
    }
  }
  const Eigen::MatrixXd capacity = (sum_of_lengths / 2).asDiagonal();
  return (capacity + h * conduction).lu().solve(capacity * before);
}

/// Temperatures after a backward Euler step of linear finite elements on the four triangles of each square, whose
/// centre is the lattice point: two corners and a centre, with the mean alpha of the three. Of a right-angled isosceles
/// triangle each short side conducts half of alpha times the areal density, the long side nothing.
Eigen::VectorXd finite_element_step(const Sheet& sheet, const Eigen::VectorXd& alpha, const Eigen::VectorXd& before) {
  Eigen::MatrixXd conduction = Eigen::MatrixXd::Zero(before.size(), before.size());
  const double density = SheetOptions().areal_density;
  for (std::size_t c = 0; c < sheet.cells.size(); ++c) {
    const PetscInt centre = sheet.lattice[c];
    for (std::size_t k = 0; k < 4; ++k) {
      const PetscInt a = sheet.cells[c][k];
      const PetscInt b = sheet.cells[c][(k + 1) % 4];
      const double mean = (alpha[a] + alpha[b] + alpha[centre]) / 3;
      join(conduction, a, centre, density * mean / 2);
      join(conduction, b, centre, density * mean / 2);
    }
  }
  const Eigen::MatrixXd capacity =
      Eigen::Map<const Eigen::VectorXd>(sheet.initial_mass.data(), before.size()).asDiagonal();
  return (capacity + h * conduction).lu().solve(capacity * before);
}

TEST(TexturesOfASheet, DiffusivityFollowsBrightnessBetweenTheEndsOfItsRange) {
  const TestFolder folder;
  Options options = options_at_rest();
  options.heat.ksp_rtol = 1e-14;
  options.heat.diffusivity = 2;
  options.heat.diffusivity_texture = write_picture(folder);
  options.heat.diffusivity_range = {0.1, 3};
  options.combustion.mass_loss_rate = 0;
  for (const char* name : {"umbrella", "consistent"}) {
    options.heat.operator_name = name;
    RestingSheet sheet(grid_mesh(4, 3, edge), options, PETSC_COMM_SELF);
    const PetscInt count = sheet.surface().particles.local();
    Eigen::VectorXd alpha(count);
    for (PetscInt i = 0; i < count; ++i) {
      alpha[i] = 2 * (0.1 + 2.9 * sheet.bright(i, 4, 3));
      sheet.burning().temperature.data()[i] = 300 + (17 * i) % 100;
    }
    sheet.burning().heat_initial =
        heat_content(sheet.surface(), sheet.burning().mass, sheet.burning().temperature, options.heat.capacity);
    const Eigen::VectorXd before = sheet.burning().temperature.values().row(0);
    const Eigen::VectorXd expected = std::string(name) == "umbrella"
                                         ? umbrella_step(sheet.sheet(), alpha, before)
                                         : finite_element_step(sheet.sheet(), alpha, before);
    sheet.step();
    const Eigen::VectorXd found = sheet.burning().temperature.values().row(0);
    EXPECT_GT((expected - before).cwiseAbs().maxCoeff(), 10);
    EXPECT_LE((found - expected).cwiseAbs().maxCoeff(), 1e-8) << name;
  }
}

TEST(TexturesOfASheet, AWeightIsTheMeanOfTheBrightnessAtBothEndsOfASpring) {
  // One cell of which corner 1 alone may move, by its two blue springs: to corner 0 (black) and to corner 2 (white).
  const TestFolder folder;
  Options options = options_at_rest();
  options.project.weight_texture = write_picture(folder);
  options.project.weight = {0, 0, 0.8, 0};
  options.project.shift = 0.1;
  options.project.max_steps = 1;
  options.project.masses = "equal";
  options.pins["rest"].vertices = {0, 2, 3};
  options.pins["lattice"].box = {-1, -1, 1e-3, 1, 1, 1};
  options.combustion.mass_loss_rate = 0;
  RestingSheet sheet(grid_mesh(1, 1, edge), options);
  const Eigen::Vector3d start(1.2 * edge, -0.1 * edge, 0);
  for (PetscInt i = 0; i < sheet.surface().particles.local(); ++i) {
    if (sheet.surface().persistent_id[i] == 1) {
      sheet.state().position.vector(i) = start;
    }
  }
  sheet.step();
  // (J J^T + shift max) lambda = w C, x -= J^T lambda (eq. 16, 17 and 19).
  const double of_one = brightness(1, 0);
  const Eigen::Vector2d weight =
      0.8 * Eigen::Vector2d((brightness(0, 0) + of_one) / 2, (of_one + brightness(1, 1)) / 2);
  Eigen::Matrix<double, 2, 3> gradient;
  Eigen::Vector2d error;
  const std::array<Eigen::Vector3d, 2> others{Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(edge, edge, 0)};
  for (int spring = 0; spring < 2; ++spring) {
    const Eigen::Vector3d d = start - others[spring];
    error[spring] = d.squaredNorm() / edge - edge;
    gradient.row(spring) = 2 / edge * d.transpose();
  }
  Eigen::Matrix2d gram = gradient * gradient.transpose();
  gram += 0.1 * gram.diagonal().maxCoeff() * Eigen::Matrix2d::Identity();
  const Eigen::Vector3d end = start - gradient.transpose() * gram.lu().solve(weight.cwiseProduct(error));
  for (PetscInt i = 0; i < sheet.surface().particles.local(); ++i) {
    if (sheet.surface().persistent_id[i] == 1) {
      EXPECT_LE((sheet.state().position.vector(i) - end).norm(), 1e-12 * edge);
    }
  }
}

/// When a sheet first tore, and the centres of its torn cells on this rank.
struct Tear {
  double time = 0;  ///< [s]
  std::vector<double> x;
};

/// Pulls a strip of eight cells apart until it tears.
/// @param mass that is left of it, as a fraction
Tear tear(Options options, double mass = 1) {
  options.sheet.areal_density = 1;
  options.combustion.mass_loss_rate = 0;
  options.pins["left"].box = {-1, -1, -1, 0.01, 1, 1};
  options.pins["left"].velocity = {-0.005, 0, 0};
  options.pins["right"].box = {8 * edge - 0.01, -1, -1, 2, 1, 1};
  options.pins["right"].velocity = {0.005, 0, 0};
  RestingSheet sheet(grid_mesh(8, 1, edge), options);
  sheet.burning().mass.values() *= mass;
  sheet.burning().heat_initial *= mass;
  bool torn = false;
  bool converged = true;
  while (!torn && converged && sheet.state().step < 100) {
    const AloneStep result = sheet.advance(h);
    converged = result.converged;
    EXPECT_TRUE(converged) << result.reason;
    torn = result.has_cracked;
  }
  EXPECT_TRUE(torn);
  EXPECT_EQ(sheet.burning().mass_burnt, 0);
  Tear result{sheet.state().time, {}};
  for (PetscInt c = 0; c < sheet.surface().elements.owned; ++c) {
    const auto first = sheet.burning().active.cracked.begin() + static_cast<std::ptrdiff_t>(4 * c);
    EXPECT_EQ(sheet.burning().burn_time[c], -1) << "cell " << c << " has not burnt";
    if (std::count(first, first + 4, true) > 0) {
      result.x.push_back(sheet.surface().rest(0, sheet.surface().lattice[c]));
    }
  }
  return result;
}

TEST(TexturesOfASheet, StrengthFollowsBrightness) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  const TestFolder folder;
  Options options = options_at_rest();
  options.ablation.strength = 100;
  options.ablation.strength_texture = write_picture(folder);
  for (const bool is_left_weak : {true, false}) {
    options.ablation.strength_range = is_left_weak ? std::vector<double>{0.2, 5} : std::vector<double>{5, 0.2};
    const std::vector<double> torn = tear(options).x;
    for (const double x : torn) {
      EXPECT_EQ(x < 4 * edge, is_left_weak) << x;
    }
    auto count = static_cast<int>(torn.size());
    MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
    EXPECT_GT(count, 0);
  }
  // Where black and white mean the same, the picture is that factor everywhere.
  options.ablation.strength_range = {0.5, 0.5};
  const Tear textured = tear(options);
  options.ablation.strength_texture.clear();
  EXPECT_LT(textured.time, tear(options).time);
  options.ablation.strength = *options.ablation.strength / 2;
  const Tear plain = tear(options);
  EXPECT_EQ(textured.time, plain.time);
  EXPECT_EQ(textured.x, plain.x);
}

TEST(CharredSheet, HasTheStrengthThatItsMassLeaves) {
  if (ranks() > 1) {
    GTEST_SKIP() << "on one rank only";
  }
  // Half of what can burn has burnt, and the density has fallen so that nothing shrinks.
  Options options = options_at_rest();
  options.combustion.min_mass = 0.3;
  options.combustion.burnt_density = 0.3 * options.combustion.initial_density;
  options.ablation.strength = 200;
  options.ablation.char_strength = 0.2;
  const Tear charred = tear(options, 0.65);
  EXPECT_LT(charred.time, tear(options).time);
  // Forces grow with the masses that they move.
  options.ablation.strength = 200 * (0.2 + 0.8 / 2) / 0.65;
  const Tear plain = tear(options);
  EXPECT_EQ(charred.time, plain.time);
  EXPECT_EQ(charred.x, plain.x);
}

TEST(TexturesOfABalloon, ThicknessFollowsBrightnessBetweenTheEndsOfItsRange) {
  const TestFolder folder;
  SurfaceMesh mesh = icosphere_mesh(1, 1);
  mesh.uv.clear();
  for (const auto& face : mesh.faces) {
    auto& uv = mesh.uv.emplace_back();
    for (const int point : face) {
      uv.emplace_back((mesh.points[point].head<2>().array() + 1) / 2);
    }
  }
  Options options;
  options.wall.thickness_texture = write_picture(folder);
  options.wall.thickness_range = {2e-4, 7e-4};
  StaticBalloon balloon(mesh, options);
  const Membrane& membrane = balloon.membrane();
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    Eigen::Vector2d uv(0, 0);
    for (const PetscInt corner : membrane.triangles[e]) {
      uv += (membrane.rest.col(corner).head<2>() + Eigen::Vector2d::Ones()) / 2 / 3;
    }
    EXPECT_NEAR(balloon.elements().wall().thickness[e], 2e-4 + 5e-4 * brightness(uv.x(), uv.y()), 1e-15) << e;
  }
}

TEST(Textures, AreReadOnceAndNeedTextureCoordinates) {
  const TestFolder folder;
  const std::string path = write_picture(folder);
  Textures textures(PETSC_COMM_WORLD);
  Eigen::Matrix2Xd uv(2, 2);
  uv << 0.3, 0.9, 0.6, 0.1;
  const std::vector<double> expected{brightness(0.3, 0.6), brightness(0.9, 0.1)};
  const std::vector<double> values = textures.values(uv, "some.key", path);
  ASSERT_EQ(values.size(), 2U);
  EXPECT_NEAR(values[0], expected[0], 1e-12);
  EXPECT_NEAR(values[1], expected[1], 1e-12);
  EXPECT_TRUE(textures.values(uv, "some.key", "").empty());
  MPI_Barrier(PETSC_COMM_WORLD);
  if (folder.rank() == 0) {
    std::filesystem::remove(path);
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  EXPECT_EQ(textures.values(uv, "some.key", path), values) << "it is read again";
  EXPECT_EQ(error_text([&] { textures.values(Eigen::Matrix2Xd(2, 0), "some.key", path); }),
            "some.key: " + path + " needs texture coordinates, and the mesh has none");
}

}  // namespace
}  // namespace pellicle::textures_test
