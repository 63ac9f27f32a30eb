#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "options/arguments.h"
#include "options/spelling.h"

namespace pellicle {

/// The condition that a text is one of some values.
inline Condition one_of(const std::string& key, const std::string& text, const std::vector<std::string>& values) {
  return {key + ": " + join(values, ", "),
          [&text, values] { return std::find(values.begin(), values.end(), text) != values.end(); }};
}

/// A named object of the tests.
struct SampleBody {
  std::string shape = "sphere";
  double radius = 0.1;
  double inner_radius = 0;
  Rows path;
};

inline void describe(OptionTable& table, SampleBody& body) {
  table.add("shape", body.shape).choices({"sphere", "plane"}).help("What it is.");
  table.add("radius", body.radius).unit("m").more_than(0).help("Radius of a sphere.");
  table.add("inner_radius", body.inner_radius).unit("m").at_least(0).help("Radius of the hole.");
  table.add("path", body.path).unit("s, m, m, m").help("Key points: time and place.");
}

/// One option of each kind, and the table that declares them.
struct SampleOptions {
  std::string dynamics = "projection";
  double diffusivity = 2e-3;
  double ignition = 500;
  double rate = 0.02;
  bool springs = false;
  int iterations = 7;
  std::optional<double> edge_length;
  Eigen::Vector3d gravity{0, 0, -9.81};
  std::vector<double> weights{1, 1, 1, 1};
  std::vector<int> vertices;
  std::vector<std::string> fields{"temperature"};
  std::string file;
  double shift = 1e-3;
  std::map<std::string, SampleBody> bodies;
  std::map<std::string, SampleBody> balls;
  OptionTable table;

  SampleOptions() {
    table.add("dynamics", dynamics).choices({"projection", "spring"}).help("How the sheet moves.");
    table.add("heat.diffusivity", diffusivity)
        .unit("m^2/s")
        .at_least(0)
        .help("Thermal diffusivity.")
        .source("burning paper, eq. 2");
    table.add("heat.ignition", ignition).unit("K").range(0, 5000).help("Ignition temperature.");
    table.add("combustion.rate", rate).unit("1/(K s)").help("Rate of mass loss.");
    table.add("output.springs", springs).help("Whether springs are written.");
    table.add("output.fields", fields).choices({"temperature", "strain", "rank"}).help("What is written.");
    table.add("project.iterations", iterations).range(1, 100).help("Steps of one projection.");
    table.add("project.weights", weights).length(4).range(0, 1).help("Weights.");
    table.add("project.shift", shift).help("Diagonal shift.");
    table.add("mesh.edge_length", edge_length).unit("m").more_than(0).help("Wanted length of an edge.");
    table.add("mesh.file", file).help("File of the mesh.");
    table.add("mesh.vertices", vertices).at_least(0).help("Vertices.");
    table.add("time.gravity", gravity).unit("m/s^2").help("Gravity.");
    table.add_objects("bodies", bodies, "Bodies that the sheet meets.");
    table.add_objects("heat.balls", balls, "Balls of heat.");
    table.add_solver_prefix("project_", {"red_", "green_", "blue_", "yellow_"});
    table.add_solver_prefix("heat_");
  }

  /// What `read_deck` says of a deck named deck.yaml; "" when it accepts it.
  std::string deck_error(const std::string& text) {
    try {
      read_deck({"deck.yaml", text}, table, petsc);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  /// Reads a command line; its decks must exist.
  ProgramArguments command_line(const std::vector<std::string>& words) {
    return read_arguments(PETSC_COMM_WORLD, words, table,
                          [this](const std::string& name) -> OptionTable& { return objects[name].table; });
  }

  std::string command_line_error(const std::vector<std::string>& words) {
    try {
      command_line(words);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  std::vector<PetscOption> petsc;
  std::map<std::string, SampleOptions> objects;  ///< that a deck has named
};

}  // namespace pellicle
