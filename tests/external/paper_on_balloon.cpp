// A world in memory: a burning sheet falls on a balloon and stays on it. The program reads arrays, pushes the balloon
// by a function, leads the balloon's lowest point by another one, undoes a step, and writes nothing. Exit code 1 where
// something is not as it should be.

#include <mpi.h>
#include <pellicle/base/error.h>
#include <pellicle/parallel/field.h>
#include <pellicle/world/world.h>
#include <petscvec.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <string>

using namespace pellicle;

namespace {

constexpr double radius = 0.05;  // of the balloon [m]
constexpr double h = 2e-3;       // [s]

Options paper_options() {
  Options options;
  options.mesh.cells = {10, 10};
  options.mesh.size = {0.08, 0.08};
  options.mesh.shift = {-0.04, -0.04, radius + 0.01};
  options.sheet.thickness = 4e-3;
  options.heat.initial_temperature = 700;  // It burns from the start.
  options.contact.self = true;
  options.contact.thickness = 2e-3;
  return options;
}

Options balloon_options(const Eigen::Vector3d& speed) {
  Options options;
  options.chain = ChainKind::inflate;
  options.mesh.shape = MeshShape::icosphere;
  options.mesh.level = 2;
  options.mesh.radius = radius;
  options.chambers["air"].law = GasLaw::isothermal;
  options.contact.self = true;
  options.contact.thickness = 2e-3;
  PinOptions& foot = options.pins["foot"];
  foot.box = {-1, -1, -1, 1, 1, -0.95 * radius};
  foot.motion = [speed](double time) -> Eigen::Vector3d { return speed * time; };
  return options;
}

/// The sum of an entry of a field over the particles of all ranks, by a PETSc vector without a copy. Collective.
double sum_of(Object& object, const std::string& name, PetscInt entry) {
  Field& field = object.field(name);
  const VecHandle vec = vec_of(object.surface().particles, field);
  PetscScalar sum = 0;
  check(VecStrideSum(vec, entry, &sum));
  return sum;
}

void require(bool is_so, const std::string& words) {
  if (!is_so) {
    throw Error(words);
  }
}

/// Collective. @throws Error where something is not as it should be
void meet(MPI_Comm comm) {
  const Eigen::Vector3d speed(0.02, 0, 0);
  World world(comm, {NamedOptions("paper", paper_options()), NamedOptions("balloon", balloon_options(speed))});
  Object& paper = world.object("paper");
  Object& balloon = world.object("balloon");
  balloon.add_stage(accelerating([](const Eigen::Vector3d& place, const Eigen::Vector3d&, double time) {
    return Eigen::Vector3d(0, place.z() > 0 && time < 0.02 ? 1 : 0, 0);
  }));
  const double mass = sum_of(paper, "mass", 0);
  const double y = sum_of(balloon, "position", 1);
  double pressing = 0;
  for (int n = 0; n < 60; ++n) {
    const StepResult result = world.step(h);
    require(result.converged, "step " + std::to_string(world.steps() + 1) + ": " + result.reason);
    pressing = std::max(pressing, paper.last_step().balance.contact->energy);
  }
  require(pressing > 0, "the paper does not touch the balloon");
  require(sum_of(paper, "mass", 0) < 0.999 * mass, "the paper does not burn");
  require(sum_of(balloon, "position", 1) > y, "the balloon is not pushed");

  // The lowest points are where the function leads them.
  const Surface& wall = balloon.surface();
  for (PetscInt i = 0; i < wall.particles.owned; ++i) {
    if (wall.rest(2, i) <= -0.95 * radius) {
      const Eigen::Vector3d led = wall.rest.col(i) + world.time() * speed;
      require((balloon.state().position.vector(i) - led).norm() < 1e-12, "the foot is not where it is led");
    }
  }

  // A step that is undone leaves nothing behind: the next one ends as it did, to the last bit.
  world.keep();
  require(world.advance(h).converged, "the step that is undone");
  const Eigen::MatrixXd after = paper.state().position.values();
  world.restore();
  require(world.advance(h).converged, "the step that is made again");
  require(after == paper.state().position.values(), "a step that was undone ends elsewhere");
  world.accept(world.time());
  PetscPrintf(comm, "%d steps to %.3f s: the paper has %.4f of its mass, the balloon %.1f Pa\n", world.steps(),
              world.time(), sum_of(paper, "mass", 0) / mass, balloon.state().pressure[0]);
}

}  // namespace

int main(int argc, char** argv) {
  PetscInitialize(&argc, &argv, nullptr, nullptr);
  int code = 0;
  try {
    meet(PETSC_COMM_WORLD);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "paper_on_balloon: %s\n", failure.what());
    code = 1;
  }
  PetscFinalize();
  return code;
}
