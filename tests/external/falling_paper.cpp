// A chain with a stage of its own: a hot sheet of paper falls through wind while it chars. Heat, combustion and
// dynamics are pellicle's stages, the drag of the air is this program's. Lighter and lighter, the sheet ends at the
// speed at which its drag carries what is left of it. Prints the figures; exit code 1 where they are not as they should
// be.

#include <mpi.h>
#include <pellicle/base/error.h>
#include <pellicle/meshing/generators.h>
#include <pellicle/surface/shell.h>
#include <pellicle/world/burn.h>
#include <petscsys.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

using namespace pellicle;

namespace {

struct Air {
  Eigen::Vector3d velocity{1, 0, 0};  ///< [m/s]
  double density = 1.2;               ///< [kg/m^3]
  double drag_coefficient = 1.17;     ///< of a plate across the stream
};

/// The drag 1/2 rho c A |w| w on every particle, w being the velocity of the air relative to it, over a time h [s]. Not
/// collective: ghosts are moved alike.
/// @param areal_density of the unburnt sheet, by which a particle's mass tells its area [kg/m^2]
void blow(Field& velocity, const Air& air, const Sheet& sheet, const Field& mass, double areal_density, double h) {
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const double area = sheet.initial_mass[i] / areal_density;
    const Eigen::Vector3d w = air.velocity - velocity.vector(i);
    velocity.vector(i) += h * (air.density * air.drag_coefficient * area / 2) * w.norm() * w / mass.data()[i];
  }
}

/// Mass [kg] and momentum [kg m/s] of the whole sheet. Collective.
Eigen::Vector4d mass_and_momentum(const Sheet& sheet, const State& state) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    sum[0] += state.mass.data()[i];
    sum.tail<3>() += state.mass.data()[i] * state.velocity.vector(i);
  }
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 4, MPI_DOUBLE, MPI_SUM, sheet.comm());
  return sum;
}

/// @returns whether the sheet ends with the mass and the velocity that it should. Collective.
bool fall(MPI_Comm comm) {
  Options options;  // those of a deck, with their defaults
  options.heat.initial_temperature = 800;
  options.heat.burning_heat = 0;
  options.combustion.burnt_density = options.combustion.min_mass * options.combustion.initial_density;  // no shrinkage
  options.force.damping = 0;
  const Air air;

  const Sheet sheet = make_sheet(comm, rectangle_mesh({20, 15}, {0.2, 0.15}), shell_options(options));
  std::vector<std::string> stages = Burn::stage_names();
  stages.emplace_back("wind");
  StageClock clock(stages);
  Burn burn(sheet, options, clock);
  State state = burn.initial_state();
  Equilibrium equilibrium({{"", &burn}}, options.contact, options.elastic, clock, burn.stage());

  const double h = options.time.step;
  while (state.time < 0.8) {
    StageResult result = burn.heat(state, h);
    if (result.converged) {
      burn.combustion(state, h);
      {
        const auto timer = clock.time("wind");
        blow(state.velocity, air, sheet, state.mass, options.sheet.areal_density, h);
      }
      result = burn.begin_dynamics(state, h);
    }
    if (result.converged) {
      const EquilibriumResult balance = equilibrium.solve(h);
      result.converged = balance.converged;
      result.reason = balance.reason;
      if (balance.converged) {
        result = burn.end_dynamics(state, balance);
      }
    }
    if (result.converged) {
      result = burn.end_step(state, h);
    }
    if (!result.converged) {
      throw Error("step " + std::to_string(state.step + 1) + ": " + result.reason);
    }
  }

  const Eigen::Vector4d sums = mass_and_momentum(sheet, state);
  const double unburnt_mass = options.sheet.areal_density * 0.2 * 0.15;
  const double mass_ratio = sums[0] / unburnt_mass;
  const Eigen::Vector3d velocity = sums.tail<3>() / sums[0];
  // Where drag carries weight: 1/2 rho c A w^2 = m g.
  const double speed = std::sqrt(2 * options.combustion.min_mass * options.sheet.areal_density *
                                 options.force.gravity.norm() / (air.density * air.drag_coefficient));
  const Eigen::Vector3d expected = air.velocity + speed * options.force.gravity.normalized();
  PetscPrintf(comm, "%d steps to %.3f s: %.6f of the mass left, expected %.6f\n", state.step, state.time, mass_ratio,
              options.combustion.min_mass);
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
