#include "combustion/combustion.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <fstream>
#include <set>

#include "meshing/closed_shapes.h"
#include "meshing/readers.h"
#include "parallel/collective.h"
#include "tests/heat/sheets.h"

namespace pellicle {
namespace {

std::vector<double> ratios(const Sheet& sheet, const Field& mass, const CombustionOptions& options) {
  std::vector<double> ratio;
  set_volume_ratios(ratio, sheet, mass, options);
  return ratio;
}

class Combustion : public ::testing::Test {
 protected:
  Combustion()
      : sheet_(shell_of(grid_mesh(6, 5, 0.1), 0.03)), mass_(initial_masses(sheet_)), change_(sheet_.particles, 1) {}

  Field uniform(double value) {
    return field_of(sheet_, [=](const Eigen::Vector3d&) { return value; });
  }
  double total(const Field& field) {
    return sum_over_ranks(PETSC_COMM_WORLD, field.values().row(0).head(sheet_.particles.owned).sum());
  }

  Sheet sheet_;
  Field mass_;
  Field change_;
  CombustionOptions options_;
};

// At constant T > T_ign the mass falls linearly; m_loss is reached after (1 - m_loss/m_init) / (mu (T - T_ign)).
TEST_F(Combustion, MassFallsLinearlyUntilTheLeastMass) {
  const Field temperature = uniform(650);
  const double rate = options_.mass_loss_rate * 150;
  const double time_until_half = (1 - 0.5) / rate;
  const int steps = 50;
  for (int n = 1; n <= 2 * steps; ++n) {
    burn(mass_, change_, sheet_, {temperature, {}, time_until_half / steps}, options_);
    const double expected = std::max(1 - 0.5 * n / steps, options_.min_mass);
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      EXPECT_NEAR(mass_.data()[i] / sheet_.initial_mass[i], expected, 1e-12);
    }
  }
  EXPECT_EQ(change_.values().cwiseAbs().maxCoeff(), 0);  // Nothing more to lose.
}

TEST_F(Combustion, NothingBurnsAtOrBelowIgnitionAndMassNeverGrows) {
  for (const double value : {0.0, 300.0, options_.ignition_temperature}) {
    const Field temperature = uniform(value);
    EXPECT_EQ(burn(mass_, change_, sheet_, {temperature, {}, 1}, options_), 0);
  }
  // Mass below the least mass, as a deck may change between runs, stays.
  mass_.values() *= 0.1;
  const Eigen::MatrixXd before = mass_.values();
  const Field hot = uniform(900);
  EXPECT_EQ(burn(mass_, change_, sheet_, {hot, {}, 1}, options_), 0);
  EXPECT_EQ((mass_.values() - before).cwiseAbs().maxCoeff(), 0);
}

TEST_F(Combustion, MassLeftAndMassBurntAddUpToTheInitialMass) {
  const double initial = total(mass_);
  EXPECT_NEAR(initial, test_density * 0.6 * 0.5, 1e-15);
  double burnt = 0;
  for (int n = 0; n < 500; ++n) {
    const Field temperature =
        field_of(sheet_, [=](const Eigen::Vector3d& x) { return 400 + 300 * std::sin(3 * x.x() + 0.01 * n) * x.y(); });
    burnt += sum_over_ranks(PETSC_COMM_WORLD, burn(mass_, change_, sheet_, {temperature, {}, 0.01}, options_));
    ASSERT_NEAR(total(mass_) + burnt, initial, 1e-12 * initial) << n;
  }
  EXPECT_GT(burnt, 0.001 * initial);
}

TEST_F(Combustion, ParticlesThatHaveLeftLoseNothingAndTheirSpringsKeepALength) {
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    mass_.data()[i] *= sheet_.rest(0, i) < 0.3 ? 0 : 1;
  }
  const double before = total(mass_);
  const Field temperature = uniform(900);
  const double burnt =
      sum_over_ranks(PETSC_COMM_WORLD, burn(mass_, change_, sheet_, {temperature, {}, 0.01}, options_));
  EXPECT_GT(burnt, 0);
  EXPECT_NEAR(total(mass_) + burnt, before, 1e-12 * before);
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    EXPECT_EQ(mass_.data()[i] == 0, sheet_.rest(0, i) < 0.3);
    EXPECT_EQ(change_.data()[i] == 0, sheet_.rest(0, i) < 0.3);
  }
  TargetLengths lengths;
  set_target_lengths(lengths, sheet_, ratios(sheet_, mass_, options_));
  for (const Colour colour : all_colours) {
    const SpringSet& springs = sheet_.of(colour);
    for (std::size_t s = 0; s < springs.ends.size(); ++s) {
      const auto& [a, b] = springs.ends[s];
      if (mass_.data()[a] == 0 && mass_.data()[b] == 0) {
        EXPECT_NEAR(lengths[static_cast<std::size_t>(colour)][s], 0.3 * 800 / 320 * springs.initial_length[s], 1e-15);
      }
    }
  }
}

TEST_F(Combustion, FactorsWeightParticlesAndLayers) {
  options_.corner_factor = 0.5;
  options_.lattice_factor = 0.25;
  std::vector<double> factor;
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    factor.push_back(0.2 + sheet_.rest(0, i));
  }
  const Field temperature = uniform(600);
  burn(mass_, change_, sheet_, {temperature, factor, 0.05}, options_);
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double layer = sheet_.is_lattice[k] ? 0.25 : 0.5;
    const double expected = -0.02 * 100 * 0.05 * layer * factor[k] * sheet_.initial_mass[k];
    EXPECT_NEAR(change_.data()[i], expected, 1e-15 * std::abs(expected) + 1e-18);
  }
}

TEST_F(Combustion, VolumeRatioFollowsMassAndDensity) {
  options_.min_mass = 0.3;
  options_.initial_density = 1000;
  options_.burnt_density = 400;
  EXPECT_EQ(volume_ratio(1, options_), 1);
  EXPECT_NEAR(volume_ratio(0.3, options_), 0.3 / 0.4, 1e-15);
  EXPECT_NEAR(volume_ratio(0.65, options_), 0.65 / 0.7, 1e-15);
  options_.burnt_density = 200;  // The density falls faster than the mass: the volume would grow.
  EXPECT_EQ(volume_ratio(0.5, options_), 1);
  options_.min_mass = 1;
  EXPECT_EQ(volume_ratio(1, options_), 1);
}

TEST_F(Combustion, TargetLengthsShrinkByTheMeanOfBothEnds) {
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    mass_.data()[i] *= sheet_.is_lattice[i] ? 1 : options_.min_mass;
  }
  TargetLengths lengths;
  set_target_lengths(lengths, sheet_, ratios(sheet_, mass_, options_));
  const double burnt = 0.3 * 800 / 320;
  const std::array<double, 4> expected{(1 + burnt) / 2, 1, burnt, burnt};
  for (const Colour colour : all_colours) {
    const auto c = static_cast<std::size_t>(colour);
    ASSERT_EQ(lengths[c].size(), sheet_.of(colour).ends.size());
    for (std::size_t s = 0; s < lengths[c].size(); ++s) {
      EXPECT_NEAR(lengths[c][s], expected[c] * sheet_.of(colour).initial_length[s], 1e-15);
    }
  }
}

TEST(CombustionReference, TargetLengthsMatch) {
  const std::string name = shared_folder() + "/reference/A1_burn";
  if (!std::ifstream(name + ".obj")) {
    GTEST_SKIP() << "no reference cases in " << shared_folder();
  }
  const YAML::Node given = YAML::LoadFile(name + ".params.json");
  const YAML::Node expected = YAML::LoadFile(name + ".expected.json");
  const SurfaceMesh mesh = read_mesh(name + ".obj");
  SheetOptions sheet_options;
  sheet_options.thickness = given["thickness"].as<double>();
  sheet_options.areal_density = given["areal_density"].as<double>();
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, mesh, sheet_options);
  CombustionOptions options;
  options.min_mass = given["params"]["m_min"].as<double>();
  options.initial_density = 1;
  options.burnt_density = given["params"]["rho_ratio"].as<double>();
  const auto masses = expected["m"].as<std::vector<double>>();
  Field mass(sheet.particles, 1);
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    mass.data()[i] = masses[sheet.persistent_id[i]];
  }
  TargetLengths lengths;
  set_target_lengths(lengths, sheet, ratios(sheet, mass, options));

  // The springs in the order of the reference: cell by cell, blue edges at their first visit.
  std::array<std::vector<std::pair<int, int>>, 4> order;
  const int corners = static_cast<int>(mesh.points.size());
  std::set<std::pair<int, int>> seen;
  for (std::size_t c = 0; c < mesh.faces.size(); ++c) {
    const std::vector<int>& face = mesh.faces[c];
    for (std::size_t k = 0; k < 4; ++k) {
      const int a = face[k];
      const int b = face[(k + 1) % 4];
      order[0].emplace_back(a, corners + static_cast<int>(c));
      if (seen.emplace(std::min(a, b), std::max(a, b)).second) {
        order[2].emplace_back(std::min(a, b), std::max(a, b));
      }
    }
    for (std::size_t k = 0; k < 2; ++k) {
      order[3].emplace_back(std::min(face[k], face[k + 2]), std::max(face[k], face[k + 2]));
    }
  }
  const std::array<const char*, 4> letters{"R", "G", "B", "Y"};
  for (const Colour colour : {Colour::red, Colour::blue, Colour::yellow}) {
    const auto c = static_cast<std::size_t>(colour);
    const auto values = expected["target_lengths"][letters[c]].as<std::vector<double>>();
    ASSERT_EQ(values.size(), order[c].size());
    std::map<std::pair<int, int>, double> by_ends;
    for (std::size_t s = 0; s < values.size(); ++s) {
      by_ends[order[c][s]] = values[s];
    }
    const SpringSet& springs = sheet.of(colour);
    for (std::size_t s = 0; s < springs.ends.size(); ++s) {
      const int a = static_cast<int>(sheet.persistent_id[springs.ends[s][0]]);
      const int b = static_cast<int>(sheet.persistent_id[springs.ends[s][1]]);
      EXPECT_NEAR(lengths[c][s], by_ends.at({std::min(a, b), std::max(a, b)}), 1e-14);
    }
  }
}

// Eq. 4 at a uniform temperature: dm = -mu h m^init (T - T^ignition), down to m^min.
TEST(CombustionOfAMembrane, MassIsLostAsOnASheet) {
  const Membrane membrane = membrane_of(icosphere_mesh(2, 0.1));
  CombustionOptions options;
  options.mass_loss_rate = 0.01;
  options.min_mass = 0.4;
  const Field temperature = field_of(membrane, [&](const Eigen::Vector3d&) { return 600.0; });
  Field mass = initial_masses(membrane);
  Field change(membrane.particles, 1);
  double lost = 0;
  for (int step = 1; step <= 10; ++step) {
    lost += sum_over_ranks(PETSC_COMM_WORLD, burn(mass, change, membrane, {temperature, {}, 0.1}, options));
    const double left = std::max(0.4, 1 - 0.1 * step);
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      const double initial = membrane.initial_mass[i];
      EXPECT_NEAR(mass.data()[i], left * initial, 1e-14 * initial);
    }
  }
  const double whole =
      sum_over_ranks(PETSC_COMM_WORLD, initial_masses(membrane).values().leftCols(membrane.particles.owned).sum());
  EXPECT_NEAR(lost, 0.6 * whole, 1e-13 * whole);
}

}  // namespace
}  // namespace pellicle
