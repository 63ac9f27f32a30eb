// A balloon whose wall heats, chars and burns through: what is left of the wall, rollback, and the hole.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numeric>

#include "contact/body_heat.h"
#include "meshing/closed_shapes.h"
#include "parallel/collective.h"
#include "tests/io/files.h"
#include "tests/support/csv.h"
#include "tests/support/solver_options.h"
#include "tests/support/state_values.h"
#include "tests/world/one_object.h"
#include "tests/world/static_balloon.h"

namespace pellicle::burning_balloon_test {
namespace {

constexpr double h = 5e-3;  // [s]

/// A ball of rubber with a little pressure, one side of which a hot ball burns within a few steps.
Options burning_options() {
  Options options;
  options.force.gravity.setZero();
  options.prism.mass_damping = 20;
  ChamberOptions& gas = options.chambers["gas"];
  gas.law = GasLaw::isothermal;
  gas.amount_ratio = {{0, 1.02}};
  HeatSource& ball = options.heat.sources["flame"];
  ball.centre = {0.12, 0.01, 0.02};
  ball.radius = 0.1;
  ball.temperature = 2000;
  ball.rate = 100;
  options.heat.convection = 20;
  options.heat.diffusivity = 1e-3;
  options.combustion.ignition_temperature = 600;
  options.combustion.mass_loss_rate = 0.05;
  options.combustion.min_mass = 0.2;
  options.combustion.initial_density = 1000;
  options.combustion.burnt_density = 250;
  options.combustion.char_stiffness = 0.25;
  options.ablation.loss_mass = 0.5;
  options.output.name = "balloon";
  return options;
}

double summed(double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  return value;
}

/// A balloon that is somewhat stretched.
struct Stretched : StaticBalloon {
  explicit Stretched(const Options& options) : StaticBalloon(icosphere_mesh(2, 0.1), options) {
    for (PetscInt i = 0; i < membrane().particles.local(); ++i) {
      state().position.vector(i) = Eigen::Vector3d(1.2, 1.5, 0.9).asDiagonal() * membrane().rest.col(i);
    }
  }
  double energy() { return summed(elements().energy(state().position, state().thickness_ratio)); }
  double mass() {
    const double* masses = object.motion().mass();
    return summed(std::accumulate(masses, masses + membrane().particles.owned, 0.0));
  }
  /// All of the wall has burnt down to this fraction of its mass.
  void burn_to(double mass_ratio) {
    const auto& initial = membrane().initial_mass;
    burning().mass.values() =
        mass_ratio * Eigen::Map<const Eigen::RowVectorXd>(initial.data(), static_cast<Eigen::Index>(initial.size()));
    object.motion().update_derived();
  }
};

TEST(BurningBalloon, CharHasTheShareOfTheStiffnessThatItsMassLeaves) {
  Options options = burning_options();
  options.combustion.burnt_density = options.combustion.min_mass * options.combustion.initial_density;  // no shrinkage
  Stretched balloon(options);
  const double whole = balloon.energy();
  const double unburnt_mass = balloon.mass();
  balloon.burn_to(0.6);  // Half of what can burn has.
  EXPECT_NEAR(balloon.energy(), (1 + 0.25) / 2 * whole, 1e-12 * whole);
  EXPECT_NEAR(balloon.mass(), 0.6 * unburnt_mass, 1e-12 * unburnt_mass);
  balloon.burn_to(0.2);
  EXPECT_NEAR(balloon.energy(), 0.25 * whole, 1e-12 * whole);
  balloon.burn_to(1);
  EXPECT_EQ(balloon.energy(), whole);
}

TEST(BurningBalloon, RubberIsAsStiffAsItIsWarm) {
  Options options = burning_options();
  Stretched balloon(options);
  const double at_reference = balloon.energy();
  options.wall.reference_temperature = 250;
  Stretched warm(options);
  for (const double temperature : {250.0, 300.0, 500.0}) {
    warm.burning().temperature.values().setConstant(temperature);
    warm.object.motion().update_derived();
    EXPECT_NEAR(warm.energy(), temperature / 250 * at_reference, 1e-12 * at_reference);
  }
}

// A wall whose material is v times as long has no energy when it is.
TEST(BurningBalloon, CharShrinksAsTheVolumeOfItsMatter) {
  const Options options = burning_options();
  Stretched balloon(options);
  const double whole = balloon.energy();
  balloon.burn_to(0.4);
  const double v = volume_ratio(0.4, options.combustion);
  EXPECT_LT(v, 0.95);
  balloon.state().position.values() = v * balloon.membrane().rest;
  EXPECT_LT(std::abs(balloon.energy()), 1e-12 * whole);
  // Otherwise it is as a wall of that size: energies of the same stretches as v^2.
  for (PetscInt i = 0; i < balloon.membrane().particles.local(); ++i) {
    balloon.state().position.vector(i) =
        v * Eigen::Vector3d(1.2, 1.5, 0.9).asDiagonal() * balloon.membrane().rest.col(i);
  }
  const double stiffness = 1 - 0.75 * burnt_share(0.4, options.combustion);
  EXPECT_NEAR(balloon.energy(), stiffness * v * v * whole, 1e-12 * whole);
}

// It rests on bodies at a gap of the thickness of contact.
TEST(BurningBalloon, AHotPlaneHeatsWhatIsNearIt) {
  Options options = burning_options();
  options.heat.sources.clear();
  options.heat.convection = 0;
  options.contact.thickness = 2e-3;
  BodyOptions& floor = options.bodies["floor"];
  floor.shape = "plane";
  floor.point = {0, 0, -0.1005};
  floor.temperature = 500;
  Stretched balloon(options);
  balloon.state().position.values() = balloon.membrane().rest;
  constexpr double short_step = 1e-6;
  const BurningFields& fields = balloon.burning();
  const double conductance =
      body_conductance(balloon.membrane(), make_bodies(PETSC_COMM_WORLD, options.bodies).front(),
                       {balloon.state().position, fields.mass, fields.active, 0, short_step, 0, 2e-3})
          .sum();
  const AloneStep step = balloon.advance(short_step);
  EXPECT_TRUE(step.converged) << step.reason;
  const double expected = summed(conductance) * 200 * short_step;
  EXPECT_GT(expected, 1e-4);
  EXPECT_NEAR(summed(fields.heat_in), expected, 1e-6 * expected);
}

TEST(BurningBalloon, AVertexWithoutElementsStaysWhereItIs) {
  Options options = burning_options();
  options.chambers["gas"].law = GasLaw::pressure;
  options.chambers["gas"].amount_ratio.clear();
  options.chambers["gas"].pressure = {{0, 1}};
  options.heat.sources["flame"].rate = 2000;
  options.combustion.burnt_density = options.combustion.min_mass * options.combustion.initial_density;  // no shrinkage
  Stretched balloon(options);
  balloon.state().position.values() = balloon.membrane().rest;
  Field before(balloon.membrane().particles, 3);
  std::vector<bool> had_left(balloon.membrane().particles.local(), false);
  PetscInt left = 0;
  for (int step = 0; step < 12; ++step) {
    before.values() = balloon.state().position.values();
    const AloneStep result = balloon.advance(h);
    ASSERT_TRUE(result.converged) << step << ": " << result.reason;
    left = 0;
    for (PetscInt i = 0; i < balloon.membrane().particles.local(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (had_left[k]) {
        EXPECT_EQ(balloon.state().position.vector(i), before.vector(i));
        EXPECT_EQ(balloon.state().velocity.vector(i), Eigen::Vector3d::Zero());
      }
      had_left[k] = balloon.burning().mass.data()[i] == 0;
      left += had_left[k] && i < balloon.membrane().particles.owned ? 1 : 0;
    }
  }
  EXPECT_GT(summed(left), 5);
  for (std::size_t e = 0; e < balloon.membrane().triangles.size(); ++e) {
    EXPECT_EQ(balloon.elements().stiffness(e) > 0, balloon.burning().active.triangles[e]);
  }
  balloon.object.accept(balloon.state().time);
  EXPECT_EQ(balloon.object.ended(), "") << "the law pressure needs no closed wall";
}

class BurningBalloonRuns : public ::testing::Test {
 protected:
  static Options options_in(const TestFolder& folder) {
    Options options = burning_options();
    options.output.directory = folder / "out";
    return options;
  }

  /// Steps until the run ends by itself. @returns how many it took
  int run_to_the_end() {
    int steps = 0;
    while (run_.ended().empty() && steps < 100) {
      run_.keep();
      const StepResult result = run_.advance(h);
      EXPECT_TRUE(result.converged) << result.reason;
      run_.accept(run_.time());
      run_.record(0);
      ++steps;
    }
    return steps;
  }
  State& state() { return run_.state(); }

  TestFolder folder_;
  Options options_ = options_in(folder_);
  OneObject run_{icosphere_mesh(2, 0.1), options_, ChainKind::inflate};
};

TEST_F(BurningBalloonRuns, EndsWithTheHoleWhoseElementIsTheFirst) {
  run_.begin();
  EXPECT_EQ(run_.ended(), "");
  const int steps = run_to_the_end();
  EXPECT_GT(steps, 3);
  EXPECT_LT(steps, 100);
  // The lowest id of the elements that have begun to burn away, wherever they are.
  const Membrane& membrane = run_.membrane();
  const std::vector<double>& burn_time = state().burning->burn_time;
  PetscInt first = membrane.elements.global;
  for (std::size_t e = 0; e < burn_time.size(); ++e) {
    first = burn_time[e] >= 0 ? std::min(first, membrane.element_id[e]) : first;
  }
  MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPIU_INT, MPI_MIN, PETSC_COMM_WORLD);
  ASSERT_LT(first, membrane.elements.global);
  const std::string text = run_.ended();
  EXPECT_EQ(text.find("chamber gas is open: element " + std::to_string(first) + " at ("), 0U) << text;
  EXPECT_NE(text.find(") m has burnt through"), std::string::npos) << text;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // of the middle of the element
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    for (const PetscInt vertex : membrane.triangles[e]) {
      place += (membrane.element_id[e] == first ? 1.0 / 3 : 0) * state().position.vector(vertex);
    }
  }
  Eigen::Vector3d told;
  ASSERT_EQ(std::sscanf(text.c_str() + text.find('('), "(%lf, %lf, %lf)", &told[0], &told[1], &told[2]), 3) << text;
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(told[k], summed(place[k]), 1e-4) << text;
  }
  run_.draw();
}

TEST_F(BurningBalloonRuns, AStepThatIsPutBackLeavesNoTrace) {
  run_.draw();
  for (int step = 0; step < 4; ++step) {
    ASSERT_TRUE(run_.advance(h).converged);
    run_.accept(run_.time());
  }
  run_.record(0);
  run_.keep();
  const StateValues before = values_of(state());
  ASSERT_TRUE(run_.advance(h).converged);
  const StateValues after = values_of(state());
  for (const char* name : {"mass", "temperature"}) {
    EXPECT_TRUE(on_any_rank(PETSC_COMM_WORLD, after.at(name) != before.at(name))) << name;
  }
  run_.restore();
  EXPECT_EQ(values_of(state()), before);
  // What is recorded now is of the wall as it was.
  run_.record(0);
  if (folder_.rank() == 0) {
    const std::vector<double> energy = read_csv(folder_ / "out/history.csv").at("elastic_energy");
    EXPECT_EQ(energy, std::vector<double>(2, energy.front()));
    EXPECT_GT(energy.front(), 0);
  }
}

}  // namespace
}  // namespace pellicle::burning_balloon_test
