#include "heat/conduction.h"

#include <gtest/gtest.h>

#include "heat/heat_balance.h"
#include "parallel/collective.h"
#include "tests/heat/sheets.h"

namespace pellicle {
namespace {

HeatOptions options_for(const std::string& operator_name, const std::string& mat_type = "aij") {
  HeatOptions options;
  options.operator_name = operator_name;
  options.mat_type = mat_type;
  options.diffusivity = 0.3;
  options.ksp_rtol = 1e-12;
  return options;
}

void advance(Conduction& conduction, Field& temperature, const Field& positions, const Field& mass,
             const ActiveSet& active, double step, int steps) {
  for (int n = 0; n < steps; ++n) {
    const StageResult result = conduction.advance(temperature, {positions, mass, active, step});
    ASSERT_TRUE(result.converged) << result.reason;
  }
}

/// Largest difference of the owned values from a function of the rest position.
double largest_error(const Sheet& sheet, const Field& temperature,
                     const std::function<double(const Eigen::Vector3d&)>& expected) {
  double error = 0;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {  // Ghosts too: they must be up to date.
    error = std::max(error, std::abs(temperature.data()[i] - expected(sheet.rest.col(i))));
  }
  return max_over_ranks(PETSC_COMM_WORLD, error);
}

class ConductionOf : public ::testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Matrices, ConductionOf, ::testing::Values("aij", "shell"));

// cos(k x) on an insulated unit square of n cells is an eigenvector, of eigenvalue 8 (1 - cos(k a/2)) / a^2.
TEST_P(ConductionOf, DecaysAModeByBackwardEuler) {
  const double step = 0.02;
  const int steps = 5;
  const double wave_number = M_PI;
  std::vector<double> errors;
  for (const int n : {8, 16, 32}) {
    const double a = 1.0 / n;
    const Sheet sheet = shell_of(grid_mesh(n, n, a), 0.2 * a);
    const HeatOptions options = options_for("consistent", GetParam());
    Conduction conduction(sheet, options, {});
    Field temperature =
        field_of(sheet, [&](const Eigen::Vector3d& x) { return 400 + 100 * std::cos(wave_number * x.x()); });
    advance(conduction, temperature, rest_positions(sheet), initial_masses(sheet), ActiveSet(sheet), step, steps);
    const auto mode = [&](double eigenvalue) {
      const double amplitude = 100 * std::pow(1 + options.diffusivity * step * eigenvalue, -steps);
      return [=](const Eigen::Vector3d& x) { return 400 + amplitude * std::cos(wave_number * x.x()); };
    };
    EXPECT_LT(largest_error(sheet, temperature, mode(8 * (1 - std::cos(wave_number * a / 2)) / (a * a))), 1e-9);
    errors.push_back(largest_error(sheet, temperature, mode(wave_number * wave_number)));
  }
  EXPECT_NEAR(errors[0] / errors[1], 4, 0.1);
  EXPECT_NEAR(errors[1] / errors[2], 4, 0.03);
}

TEST_P(ConductionOf, IsFirstOrderInTime) {
  const double a = 1.0 / 12;
  const Sheet sheet = shell_of(grid_mesh(12, 12, a), 0.01);
  const HeatOptions options = options_for("consistent", GetParam());
  const double eigenvalue = 8 * (1 - std::cos(M_PI * a / 2)) / (a * a);
  std::vector<double> errors;
  for (const int steps : {10, 20, 40}) {
    Conduction conduction(sheet, options, {});
    Field temperature = field_of(sheet, [](const Eigen::Vector3d& x) { return std::cos(M_PI * x.x()); });
    advance(conduction, temperature, rest_positions(sheet), initial_masses(sheet), ActiveSet(sheet), 0.1 / steps,
            steps);
    const double amplitude = std::exp(-options.diffusivity * eigenvalue * 0.1);
    errors.push_back(largest_error(sheet, temperature,
                                   [&](const Eigen::Vector3d& x) { return amplitude * std::cos(M_PI * x.x()); }));
  }
  EXPECT_NEAR(errors[0] / errors[1], 2, 0.05);
  EXPECT_NEAR(errors[1] / errors[2], 2, 0.03);
}

// A Gaussian of variance s^2 becomes one of variance s^2 + 2 alpha t; the umbrella conducts with half of alpha.
TEST_P(ConductionOf, SpreadsAGaussian) {
  const double time = 0.01;
  const double variance = 0.01;
  for (const auto& [name, fraction] : {std::pair{"umbrella", 0.5}, {"consistent", 1.0}}) {
    std::vector<double> errors;
    for (const int n : {16, 32, 64}) {
      const Sheet sheet = shell_of(grid_mesh(n, n, 1.0 / n), 0);
      const HeatOptions options = options_for(name, GetParam());
      const auto gaussian = [](double width, const Eigen::Vector3d& x) {
        const double squared = (x - Eigen::Vector3d(0.5, 0.5, 0)).squaredNorm();
        return std::exp(-squared / (2 * width)) / width;
      };
      Conduction conduction(sheet, options, {});
      Field temperature = field_of(sheet, [&](const Eigen::Vector3d& x) { return gaussian(variance, x); });
      const int steps = n * n / 16;  // Errors of time and space fall alike.
      advance(conduction, temperature, flat_positions(sheet), initial_masses(sheet), ActiveSet(sheet), time / steps,
              steps);
      const double later = variance + 2 * fraction * options.diffusivity * time;
      errors.push_back(later *
                       largest_error(sheet, temperature, [&](const Eigen::Vector3d& x) { return gaussian(later, x); }));
    }
    EXPECT_LT(errors[2], 2e-3) << name;
    EXPECT_GT(errors[0] / errors[1], 3.6) << name;
    EXPECT_GT(errors[1] / errors[2], 3.6) << name;
  }
}

TEST_P(ConductionOf, AUniformFieldStaysUniformAndHeatIsConserved) {
  const Sheet sheet = shell_of(irregular_mesh(9, 8, 0.1), 0.03);
  Field positions = rest_positions(sheet);  // A crumpled sheet, partly burnt.
  positions.values() += 0.02 * (30 * positions.values()).array().sin().matrix();
  Field mass = initial_masses(sheet);
  std::vector<double> factor;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    mass.data()[i] *= 0.65 + 0.35 * std::sin(40 * sheet.rest(0, i));
    factor.push_back(1 + 0.8 * std::cos(20 * sheet.rest(1, i)));
  }
  for (const char* name : {"umbrella", "consistent"}) {
    const HeatOptions options = options_for(name, GetParam());
    Conduction conduction(sheet, options, factor);
    Field uniform = field_of(sheet, [](const Eigen::Vector3d&) { return 350.0; });
    advance(conduction, uniform, positions, mass, ActiveSet(sheet), 0.1, 3);
    EXPECT_EQ(largest_error(sheet, uniform, [](const Eigen::Vector3d&) { return 350; }), 0) << name;

    Field temperature =
        field_of(sheet, [](const Eigen::Vector3d& x) { return 600 + 300 * std::sin(9 * x.x() + 7 * x.y()); });
    // What the umbrella conserves is E_i T_i: the printed operator knows no masses.
    DiffusionGraph graph{umbrella_pairs(sheet), {}, {}};
    set_umbrella(graph, sheet, factor, positions, ActiveSet(sheet));
    const auto content = [&] {
      return sum_over_ranks(PETSC_COMM_WORLD,
                            std::string(name) == "umbrella"
                                ? graph.capacity.dot(temperature.values().row(0).head(sheet.particles.owned))
                                : heat_content(sheet, mass, temperature, options.capacity));
    };
    const double before = content();
    const double rough = temperature.values()(0, 0);
    advance(conduction, temperature, positions, mass, ActiveSet(sheet), 0.01, 5);
    EXPECT_NEAR(content(), before, 1e-12 * before) << name;
    EXPECT_GT(std::abs(temperature.values()(0, 0) - rough), 1) << name;
  }
}

// Green springs reach from an active cell over its edge: two columns of dead cells are a gap for both operators.
TEST_P(ConductionOf, HeatDoesNotCrossAGap) {
  const Sheet sheet = shell_of(irregular_mesh(10, 6, 0.1), 0.03);
  const auto is_dead = [](const Eigen::Vector3d& x) { return x.x() > 0.4 && x.x() < 0.6; };
  const ActiveSet active = without(sheet, is_dead);
  for (const char* name : {"umbrella", "consistent"}) {
    Conduction conduction(sheet, options_for(name, GetParam()), {});
    const auto start = [](const Eigen::Vector3d& x) { return x.x() < 0.5 ? 900 + 50 * std::sin(30 * x.y()) : 300; };
    Field temperature = field_of(sheet, start);
    Field untouched = field_of(sheet, start);
    advance(conduction, temperature, rest_positions(sheet), initial_masses(sheet), active, 0.05, 20);
    double warmest = 0;
    double largest_change = 0;
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      largest_change = std::max(largest_change, std::abs(temperature.data()[i] - untouched.data()[i]));
      if (sheet.rest(0, i) > 0.5) {
        warmest = std::max(warmest, temperature.data()[i]);
      }
    }
    EXPECT_EQ(max_over_ranks(PETSC_COMM_WORLD, warmest), 300) << name;
    EXPECT_GT(max_over_ranks(PETSC_COMM_WORLD, largest_change), 10) << name;
    advance(conduction, temperature, rest_positions(sheet), initial_masses(sheet), ActiveSet(sheet), 0.05,
            1);  // With the gap closed.
    warmest = 0;
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      warmest = std::max(warmest, sheet.rest(0, i) > 0.5 ? temperature.data()[i] : 0);
    }
    EXPECT_GT(max_over_ranks(PETSC_COMM_WORLD, warmest), 310) << name;
  }
}

/// The faces whose middle is chosen, and their points.
SurfaceMesh part_of(const SurfaceMesh& mesh, const std::function<bool(const Eigen::Vector3d&)>& is_chosen) {
  SurfaceMesh part;
  std::map<int, int> number;
  for (const std::vector<int>& face : mesh.faces) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const int point : face) {
      middle += mesh.points[point] / 4;
    }
    if (!is_chosen(middle)) {
      continue;
    }
    std::vector<int>& chosen = part.faces.emplace_back();
    for (const int point : face) {
      const auto [entry, is_new] = number.try_emplace(point, static_cast<int>(part.points.size()));
      if (is_new) {
        part.points.push_back(mesh.points[point]);
      }
      chosen.push_back(entry->second);
    }
  }
  return part;
}

// What is left of a sheet conducts as the same cells alone, whose corners at the edge have lost part of their mass's
// cells, but no mass. Cells beside active ones are kept, as their lattice points end active green springs.
TEST_P(ConductionOf, AMaskedSheetConductsAsItsLivingPartAlone) {
  const SurfaceMesh mesh = irregular_mesh(12, 8, 0.1);
  const auto is_dead = [](const Eigen::Vector3d& x) { return x.x() + 0.5 * x.y() > 0.8; };
  const auto is_kept = [](const Eigen::Vector3d& x) { return x.x() + 0.5 * x.y() < 1.05; };
  const auto start = [](const Eigen::Vector3d& x) { return 600 + 300 * std::sin(9 * x.x() + 7 * x.y()); };
  const auto mass_share = [](const Eigen::Vector3d& x) { return 0.65 + 0.35 * std::sin(40 * x.x()); };
  SheetOptions sheet_options;
  sheet_options.thickness = 0.03;
  sheet_options.areal_density = test_density;
  const Sheet whole = make_sheet(PETSC_COMM_SELF, mesh, sheet_options);
  Sheet part = make_sheet(PETSC_COMM_WORLD, part_of(mesh, is_kept), sheet_options);
  ASSERT_LT(part.elements.global, 75);
  std::vector<Eigen::Index> in_whole;
  for (PetscInt i = 0; i < part.particles.local(); ++i) {
    Eigen::Index nearest = 0;
    ASSERT_LT((whole.rest.colwise() - part.rest.col(i)).colwise().squaredNorm().minCoeff(&nearest), 1e-20);
    in_whole.push_back(nearest);
    part.initial_mass[i] = whole.initial_mass[nearest];
  }
  for (const char* name : {"umbrella", "consistent"}) {
    const auto conducted = [&](const Sheet& sheet) {
      Field mass = initial_masses(sheet);
      for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
        mass.data()[i] *= mass_share(sheet.rest.col(i));
      }
      Conduction conduction(sheet, options_for(name, GetParam()), {});
      Field temperature = field_of(sheet, start);
      const ActiveSet active = without(sheet, is_dead);
      advance(conduction, temperature, rest_positions(sheet), mass, active, 0.05, 4);
      return temperature;
    };
    const Field expected = conducted(whole);
    const Field result = conducted(part);
    double difference = 0;
    double change = 0;
    for (PetscInt i = 0; i < part.particles.local(); ++i) {
      const double value = result.data()[i];
      difference = std::max(difference, std::abs(value - expected.data()[in_whole[i]]));
      change = std::max(change, std::abs(value - start(part.rest.col(i))));
    }
    EXPECT_LT(max_over_ranks(PETSC_COMM_WORLD, difference), 1e-10 * 900) << name;
    EXPECT_GT(max_over_ranks(PETSC_COMM_WORLD, change), 100) << name;
  }
}

// Crumpled, partly burnt, with many single triangles gone and a part without any, whose particles have left.
TEST_P(ConductionOf, HeatIsConservedByWhatIsLeft) {
  const Sheet sheet = shell_of(irregular_mesh(9, 8, 0.1), 0.03);
  Field positions = rest_positions(sheet);
  positions.values() += 0.02 * (30 * positions.values()).array().sin().matrix();
  const auto has_left = [](const Eigen::Vector3d& x) { return x.x() > 0.71; };
  const ActiveSet active = without(
      sheet, [](const Eigen::Vector3d& x) { return std::sin(300 * x.x() + 170 * x.y()) > 0.3 || x.x() > 0.55; });
  Field mass = initial_masses(sheet);
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    mass.data()[i] *= has_left(sheet.rest.col(i)) ? 0 : 0.65 + 0.35 * std::sin(40 * sheet.rest(0, i));
  }
  const std::vector<double> alpha(mass.values().cols(), 1.0);
  for (const char* name : {"umbrella", "consistent"}) {
    const HeatOptions options = options_for(name, GetParam());
    Conduction conduction(sheet, options, {});
    const auto start = [](const Eigen::Vector3d& x) { return 600 + 300 * std::sin(9 * x.x() + 7 * x.y()); };
    Field temperature = field_of(sheet, start);
    DiffusionGraph graph{umbrella_pairs(sheet), {}, {}};
    set_umbrella(graph, sheet, alpha, positions, active);
    const auto content = [&] {
      return sum_over_ranks(PETSC_COMM_WORLD,
                            std::string(name) == "umbrella"
                                ? graph.capacity.dot(temperature.values().row(0).head(sheet.particles.owned))
                                : heat_content(sheet, mass, temperature, options.capacity));
    };
    const double before = content();
    advance(conduction, temperature, positions, mass, active, 0.01, 5);
    EXPECT_NEAR(content(), before, 1e-12 * before) << name;
    EXPECT_GT(largest_error(sheet, temperature, start), 10) << name;
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      if (has_left(sheet.rest.col(i))) {
        EXPECT_EQ(temperature.data()[i], start(sheet.rest.col(i))) << name;
      }
    }
  }
}

// From hardly any conduction to temperatures that are uniform at once, where the condition of the matrix is 1e12.
TEST_P(ConductionOf, HeatIsConservedWhateverTheToleranceAndTheDiffusivity) {
  const Sheet sheet = shell_of(irregular_mesh(9, 8, 0.1), 0.03);
  const auto start = [](const Eigen::Vector3d& x) { return 600 + 300 * std::sin(9 * x.x() + 7 * x.y()); };
  const Field mass = initial_masses(sheet);
  for (const double diffusivity : {1e-12, 0.3, 1e3, 1e9}) {
    for (const double tolerance : {0.1, 1e-8}) {
      HeatOptions options = options_for("consistent", GetParam());
      options.diffusivity = diffusivity;
      options.ksp_rtol = tolerance;
      Conduction conduction(sheet, options, {});
      Field temperature = field_of(sheet, start);
      const auto content = [&] {
        return sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet, mass, temperature, options.capacity));
      };
      const double before = content();
      advance(conduction, temperature, rest_positions(sheet), mass, ActiveSet(sheet), 0.01, 5);
      EXPECT_NEAR(content(), before, 1e-14 * before) << diffusivity << " m^2/s, " << tolerance;
      if (diffusivity > 1) {
        const double mean =
            before /
            (options.capacity * sum_over_ranks(PETSC_COMM_WORLD, mass.values().leftCols(sheet.particles.owned).sum()));
        EXPECT_LT(largest_error(sheet, temperature, [=](const Eigen::Vector3d&) { return mean; }), tolerance * 600);
      }
    }
  }
}

/// Sets PETSc options while it lives.
class PetscOptions {
 public:
  using List = std::vector<std::pair<std::string, std::string>>;

  explicit PetscOptions(List options) : options_(std::move(options)) {
    for (const auto& [name, value] : options_) {
      PetscOptionsSetValue(nullptr, name.c_str(), value.c_str());
    }
  }
  PetscOptions(const PetscOptions&) = delete;
  PetscOptions& operator=(const PetscOptions&) = delete;
  ~PetscOptions() {
    for (const auto& option : options_) {
      PetscOptionsClearValue(nullptr, option.first.c_str());
    }
  }

 private:
  List options_;
};

class Solvers : public ::testing::Test {
 protected:
  Solvers() : sheet_(shell_of(irregular_mesh(11, 9, 0.1), 0.03)) {}

  Field result(const std::string& operator_name, const std::string& mat_type) {
    Conduction conduction(sheet_, options_for(operator_name, mat_type), {});
    Field temperature =
        field_of(sheet_, [](const Eigen::Vector3d& x) { return 600 + 300 * std::sin(9 * x.x() + 7 * x.y()); });
    advance(conduction, temperature, rest_positions(sheet_), initial_masses(sheet_), ActiveSet(sheet_), 0.05, 2);
    return temperature;
  }

  static double difference(const Field& a, const Field& b) {
    return max_over_ranks(PETSC_COMM_WORLD, (a.values() - b.values()).cwiseAbs().maxCoeff());
  }

  Sheet sheet_;
};

TEST_F(Solvers, GiveTheSameAnswerWithEveryMethodAndPreconditioner) {
  for (const char* name : {"umbrella", "consistent"}) {
    const Field expected = [&] {
      const PetscOptions direct(
          {{"-heat_ksp_type", "preonly"}, {"-heat_pc_type", "cholesky"}, {"-heat_pc_factor_mat_solver_type", "mumps"}});
      return result(name, "aij");
    }();
    EXPECT_LT(difference(expected, result(name, "aij")), 1e-8);
    EXPECT_LT(difference(expected, result(name, "shell")), 1e-8);
    for (const char* method : {"cg", "minres", "gmres"}) {
      for (const char* preconditioner : {"none", "jacobi", "icc", "bjacobi", "asm", "gamg", "hypre"}) {
        // PETSc's own choice, restricted ASM, is not symmetric, which cg and minres need.
        const PetscOptions options(
            {{"-heat_ksp_type", method}, {"-heat_pc_type", preconditioner}, {"-heat_pc_asm_type", "basic"}});
        EXPECT_LT(difference(expected, result(name, "auto")), 1e-7) << name << " " << method << " " << preconditioner;
      }
    }
  }
}

TEST_F(Solvers, FailureIsAResultAndLeavesTheTemperature) {
  const PetscOptions options(PetscOptions::List{{"-heat_ksp_max_it", "1"}});
  Conduction conduction(sheet_, options_for("consistent"), {});
  Field temperature = field_of(sheet_, [](const Eigen::Vector3d& x) { return 600 + 300 * std::sin(9 * x.x()); });
  const Eigen::MatrixXd before = temperature.values();
  const StageResult result =
      conduction.advance(temperature, {rest_positions(sheet_), initial_masses(sheet_), ActiveSet(sheet_), 0.05});
  EXPECT_FALSE(result.converged);
  EXPECT_NE(result.reason.find("DIVERGED_ITS"), std::string::npos) << result.reason;
  EXPECT_EQ((temperature.values() - before).cwiseAbs().maxCoeff(), 0);
}

TEST_F(Solvers, WhatALooseSolverLeavesIsSolvedForAgain) {
  const Field expected = result("consistent", "aij");
  const PetscOptions loose(PetscOptions::List{{"-heat_ksp_rtol", "0.5"}});
  HeatOptions options = options_for("consistent");
  options.ksp_rtol = 1e-6;
  Conduction conduction(sheet_, options, {});
  Field temperature =
      field_of(sheet_, [](const Eigen::Vector3d& x) { return 600 + 300 * std::sin(9 * x.x() + 7 * x.y()); });
  advance(conduction, temperature, rest_positions(sheet_), initial_masses(sheet_), ActiveSet(sheet_), 0.05, 2);
  EXPECT_LT(difference(expected, temperature), 2e-6 * 600);
}

TEST_F(Solvers, OneThatCannotReachTheToleranceSaysSo) {
  const PetscOptions little_at_a_time({{"-heat_ksp_type", "richardson"},
                                       {"-heat_ksp_richardson_scale", "0.01"},
                                       {"-heat_pc_type", "jacobi"},
                                       {"-heat_ksp_rtol", "0.99"}});
  HeatOptions options = options_for("consistent");
  options.diffusivity = 1e3;
  Conduction conduction(sheet_, options, {});
  Field temperature = field_of(sheet_, [](const Eigen::Vector3d& x) { return 600 + 300 * std::sin(9 * x.x()); });
  const Eigen::MatrixXd before = temperature.values();
  const StageResult result =
      conduction.advance(temperature, {rest_positions(sheet_), initial_masses(sheet_), ActiveSet(sheet_), 0.05});
  EXPECT_FALSE(result.converged);
  EXPECT_NE(result.reason.find("heat_ leaves errors of "), std::string::npos) << result.reason;
  EXPECT_EQ((temperature.values() - before).cwiseAbs().maxCoeff(), 0);
}

TEST_F(Solvers, ValuesThatAreNoNumbersAreAFailedSolve) {
  Conduction conduction(sheet_, options_for("umbrella"), {});
  Field temperature = field_of(sheet_, [](const Eigen::Vector3d&) { return std::nan(""); });
  EXPECT_FALSE(
      conduction.advance(temperature, {rest_positions(sheet_), initial_masses(sheet_), ActiveSet(sheet_), 0.05})
          .converged);
}

}  // namespace
}  // namespace pellicle
