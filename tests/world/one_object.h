#pragma once

#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "run/world_output.h"
#include "surface/membrane.h"
#include "surface/mesh_rows.h"
#include "surface/sheet.h"
#include "tests/support/run_folder.h"

namespace pellicle {

/// A world of one object without a name, with a folder and a console that no terminal shows.
class WorldOfOne {
 public:
  WorldOfOne(const SurfaceMesh& mesh, const Options& options, ChainKind chain, int monitor)
      : own_console_(PETSC_COMM_WORLD, monitor, said_, false),
        own_folder_(options.output),
        of_one_(only(mesh, of_chain(options, chain)), {plan_of(of_chain(options, chain))}) {}

 protected:
  std::ostringstream said_;
  Console own_console_;
  RunFolder own_folder_;
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
  /// @param mesh on all ranks, of which rank 0's counts @param monitor see Console
  OneObject(const SurfaceMesh& mesh, const Options& options, ChainKind chain = ChainKind::burn, int monitor = 0)
      : WorldOfOne(mesh, options, chain, monitor),
        WorldOutput(of_one_, own_folder_.output, own_console_, options.output) {}

  Object& object() { return *world().objects().front(); }
  State& state() { return object().state(); }
  const Sheet& sheet() { return static_cast<const Sheet&>(object().surface()); }
  const Membrane& membrane() { return static_cast<const Membrane&>(object().surface()); }
  const StageClock& clock() { return object().clock(); }
  Console& console() { return own_console_; }
  /// What the console has printed, on rank 0.
  std::string said() const { return said_.str(); }
};

}  // namespace pellicle
