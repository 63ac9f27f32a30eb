// A world with a stage of a program's own: a hot sheet of paper falls through wind while it chars. Heat, combustion and
// motion are pellicle's stages, the drag of the air is this program's. Lighter and lighter, the sheet ends at the speed
// at which its drag carries what is left of it. Prints the figures; exit code 1 where they are not as they should be.

#include <mpi.h>
#include <pellicle/base/error.h>
#include <pellicle/world/world.h>
#include <petscsys.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

using namespace pellicle;

namespace {

struct Air {
  Eigen::Vector3d velocity{1, 0, 0};  ///< [m/s]
  double density = 1.2;               ///< [kg/m^3]
  double drag_coefficient = 1.17;     ///< of a plate across the stream
};

/// The drag 1/2 rho c A |w| w on every particle, w being the velocity of the air relative to it.
class Wind : public Stage {
 public:
  /// @param areal_density of the unburnt sheet, by which a particle's mass tells its area [kg/m^2]
  Wind(const Surface& surface, State& state, const Air& air, double areal_density)
      : surface_(surface), state_(state), air_(air), areal_density_(areal_density) {}

  StageResult begin(Step& step) override {
    for (PetscInt i = 0; i < surface_.particles.local(); ++i) {  // Ghosts are moved alike: they need no exchange.
      const double area = surface_.initial_mass[i] / areal_density_;
      const Eigen::Vector3d w = air_.velocity - state_.velocity.vector(i);
      const Eigen::Vector3d drag = air_.density * air_.drag_coefficient * area / 2 * w.norm() * w;
      state_.velocity.vector(i) += step.h * drag / state_.burning->mass.data()[i];
    }
    return {};
  }

 private:
  const Surface& surface_;
  State& state_;
  Air air_;
  double areal_density_;
};

/// Mass [kg] and momentum [kg m/s] of the whole sheet. Collective.
Eigen::Vector4d mass_and_momentum(const Object& sheet) {
  const State& state = sheet.state();
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (PetscInt i = 0; i < sheet.surface().particles.owned; ++i) {
    sum[0] += state.burning->mass.data()[i];
    sum.tail<3>() += state.burning->mass.data()[i] * state.velocity.vector(i);
  }
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 4, MPI_DOUBLE, MPI_SUM, sheet.surface().comm());
  return sum;
}

/// @returns whether the sheet ends with the mass and the velocity that it should. Collective.
bool fall(MPI_Comm comm) {
  Options options;  // those of a deck, with their defaults
  options.mesh.cells = {20, 15};
  options.mesh.size = {0.2, 0.15};
  options.heat.initial_temperature = 800;
  options.heat.burning_heat = 0;
  options.combustion.burnt_density = options.combustion.min_mass * options.combustion.initial_density;  // no shrinkage
  options.force.damping = 0;
  const Air air;
  const double areal_density = options.sheet.areal_density;

  World world(comm, {NamedOptions("paper", options)});
  Object& paper = world.object("paper");
  paper.add_stage(
      [=](const Surface& surface, State& state) { return std::make_unique<Wind>(surface, state, air, areal_density); });
  while (world.time() < 0.8) {
    if (const StepResult result = world.step(options.time.step); !result.converged) {
      throw Error("step " + std::to_string(world.steps() + 1) + ": " + result.reason);
    }
  }

  const Eigen::Vector4d sums = mass_and_momentum(paper);
  const double unburnt_mass = areal_density * 0.2 * 0.15;
  const double mass_ratio = sums[0] / unburnt_mass;
  const Eigen::Vector3d velocity = sums.tail<3>() / sums[0];
  // Where drag carries weight: 1/2 rho c A w^2 = m g.
  const double speed = std::sqrt(2 * options.combustion.min_mass * areal_density * options.force.gravity.norm() /
                                 (air.density * air.drag_coefficient));
  const Eigen::Vector3d expected = air.velocity + speed * options.force.gravity.normalized();
  PetscPrintf(comm, "%d steps to %.3f s: %.6f of the mass left, expected %.6f\n", world.steps(), world.time(),
              mass_ratio, options.combustion.min_mass);
  PetscPrintf(comm, "velocity (%.6f, %.6f, %.6f) m/s, expected (%.6f, %.6f, %.6f)\n", velocity[0], velocity[1],
              velocity[2], expected[0], expected[1], expected[2]);
  return std::abs(mass_ratio - options.combustion.min_mass) < 1e-9 && (velocity - expected).norm() < 1e-5 * speed;
}

}  // namespace

int main(int argc, char** argv) {
  PetscInitialize(&argc, &argv, nullptr, nullptr);
  bool is_right = false;
  try {
    is_right = fall(PETSC_COMM_WORLD);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "falling_paper: %s\n", failure.what());
    MPI_Abort(PETSC_COMM_WORLD, 2);
  }
  PetscFinalize();
  return is_right ? 0 : 1;
}
