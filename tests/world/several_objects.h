#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "surface/shell.h"
#include "tests/support/csv.h"
#include "tests/support/run_folder.h"
#include "tests/world/one_object.h"
#include "world/gas_links.h"
#include "world/group.h"

namespace pellicle {

inline SurfaceMesh on_root(const SurfaceMesh& mesh) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  return rank == 0 ? mesh : SurfaceMesh();
}

/// The world of some objects with their meshes.
struct Scene {
  Scene(std::deque<ObjectOptions> of_objects, const std::vector<SurfaceMesh>& meshes)
      : objects(std::move(of_objects)),
        groups(groups_of(objects)),
        folder(objects.front().options.output),
        world(folder.output, objects.front().options.output, members(meshes), groups) {
    world.draw();
    world.record(0, 0);
  }

  static std::vector<GroupPlan> groups_of(std::deque<ObjectOptions>& objects) {
    share_links(objects);
    return plan_groups(objects);
  }

  std::vector<World::Member> members(const std::vector<SurfaceMesh>& meshes) {
    std::vector<World::Member> list;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const Options& options = objects[i].options;
      const bool burns = options.chain == ChainKind::burn;
      World::Member& member = list.emplace_back();
      member.name = objects[i].name;
      member.clock = burns ? clock_of<BurnRun>(options) : clock_of<InflateRun>(options);
      const ObjectOutput output{folder.output, console, *member.clock, member.name, groups.size() < objects.size()};
      if (burns) {
        member.object = std::make_unique<BurnRun>(
            make_sheet(PETSC_COMM_WORLD, on_root(meshes[i]), shell_options(options)), options, output);
      } else {
        member.object = std::make_unique<InflateRun>(make_membrane(PETSC_COMM_WORLD, on_root(meshes[i]), options.sheet),
                                                     options, output);
      }
    }
    return list;
  }

  Object& object(std::size_t i) { return *world.members()[i].object; }

  void throw_all(std::size_t i, const Eigen::Vector3d& velocity) {
    object(i).state().velocity.values().colwise() = velocity;
  }

  void step(double h) {
    world.keep();
    const StepResult result = world.advance(h);
    ASSERT_TRUE(result.converged) << result.reason;
    world.accept(world.time());
    world.record(h, 0);
  }

  /// A column of a table in its last row.
  double last(const std::string& column, const std::string& table = "contacts.csv") {
    MPI_Barrier(PETSC_COMM_WORLD);
    return read_csv(objects.front().options.output.directory + "/" + table).at(column).back();
  }

  std::deque<ObjectOptions> objects;
  std::vector<GroupPlan> groups;
  std::ostringstream said;
  Console console{PETSC_COMM_WORLD, 0, said, false};
  RunFolder folder;
  World world;
};

}  // namespace pellicle
