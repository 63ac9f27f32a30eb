#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "run/world_output.h"
#include "surface/membrane.h"
#include "surface/mesh_rows.h"
#include "surface/sheet.h"

namespace pellicle {

/// A world of one object without a name.
class WorldOfOne {
 public:
  WorldOfOne(const SurfaceMesh& mesh, Options options, ChainKind chain)
      : of_one_(only(mesh, of_chain(options, chain)), {plan_of("", of_chain(options, chain))}) {}

 protected:
  World of_one_;

 private:
  /// Whether or not the options say which chain it is.
  static Options of_chain(Options options, ChainKind chain) {
    options.chain = chain;
    return options;
  }
  static std::vector<std::unique_ptr<Object>> only(const SurfaceMesh& mesh, Options options) {
    std::vector<std::unique_ptr<Object>> objects;
    objects.push_back(
        std::make_unique<Object>("", std::move(options), PETSC_COMM_WORLD, rows_of(PETSC_COMM_WORLD, mesh)));
    return objects;
  }
};

/// A world of one object, a sheet or a wall, as a deck without objects makes it, with its output.
class OneObject : private WorldOfOne, public WorldOutput {
 public:
  /// @param mesh on all ranks, of which rank 0's counts
  OneObject(const SurfaceMesh& mesh, const Options& options, OutputFolder& folder, Console& console,
            ChainKind chain = ChainKind::burn)
      : WorldOfOne(mesh, options, chain), WorldOutput(of_one_, folder, console, options.output) {}

  Object& object() { return *world().objects().front(); }
  State& state() { return object().state(); }
  const Sheet& sheet() { return static_cast<const Sheet&>(object().surface()); }
  const Membrane& membrane() { return static_cast<const Membrane&>(object().surface()); }
  const StageClock& clock() { return object().clock(); }
};

}  // namespace pellicle
