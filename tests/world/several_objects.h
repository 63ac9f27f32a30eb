#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/csv.h"
#include "tests/support/run_folder.h"
#include "tests/world/one_object.h"
#include "world/run_plan.h"

namespace pellicle {

inline SurfaceMesh on_root(const SurfaceMesh& mesh) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  return rank == 0 ? mesh : SurfaceMesh();
}

/// The world of some objects with their meshes, and its output.
struct Scene {
  Scene(std::deque<NamedOptions> of_objects, const std::vector<SurfaceMesh>& meshes)
      : plan(plan_run(std::move(of_objects))),
        folder(objects.front().options.output),
        world(made(meshes), plan.groups),
        output(world, folder.output, console, objects.front().options.output) {
    output.begin();
  }

  std::vector<std::unique_ptr<Object>> made(const std::vector<SurfaceMesh>& meshes) const {
    std::vector<std::unique_ptr<Object>> made;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      made.push_back(std::make_unique<Object>(objects[i].name, objects[i].options, PETSC_COMM_WORLD,
                                              rows_of(PETSC_COMM_WORLD, on_root(meshes[i]))));
    }
    return made;
  }

  Object& object(std::size_t i) { return *world.objects()[i]; }
  const Membrane& membrane(std::size_t i) { return static_cast<const Membrane&>(object(i).surface()); }
  const Sheet& sheet(std::size_t i) { return static_cast<const Sheet&>(object(i).surface()); }

  void throw_all(std::size_t i, const Eigen::Vector3d& velocity) {
    object(i).state().velocity.values().colwise() = velocity;
  }

  void step(double h) {
    const StepResult result = world.step(h);
    ASSERT_TRUE(result.converged) << result.reason;
    output.record(0);
  }

  /// A column of a table in its last row.
  double last(const std::string& column, const std::string& table = "contacts.csv") {
    MPI_Barrier(PETSC_COMM_WORLD);
    return read_csv(objects.front().options.output.directory + "/" + table).at(column).back();
  }

  RunPlan plan;
  const std::deque<NamedOptions>& objects{plan.objects};
  std::ostringstream said;
  Console console{PETSC_COMM_WORLD, 0, said, false};
  RunFolder folder;
  World world;
  WorldOutput output;
};

}  // namespace pellicle
