#include "io/output_options.h"

#include <filesystem>

#include "base/error.h"
#include "base/options.h"

namespace pellicle {

void OutputOptions::name_after(const std::string& deck) {
  if (name.empty()) {
    name = std::filesystem::path(deck).stem().string();
  }
  if (directory.empty()) {
    directory = "output/" + name;
  }
}

void OutputOptions::validate() const {
  // The name also stands in the XML of the .pvd.
  if (name.empty() || name.find_first_of("/&<>\"'") != std::string::npos) {
    throw Error("output.name: '" + name + "' cannot be the name of a file: expected letters, digits, '_', '-' or '.'");
  }
}

void describe(OptionTable& table, OutputOptions& options) {
  table.add("output.directory", &options.directory)
      .help(
          "folder of all files that the run writes; output/<name of the deck> unless given; files of an earlier run "
          "of the same name are replaced");
  table.add("output.name", &options.name).help("name of the .pvd file and of its frames; the deck's unless given");
  table.add("output.interval_time", &options.interval_time)
      .unit("s")
      .at_least(0)
      .help("simulated time between frames; 0: output.interval_steps counts");
  table.add("output.interval_steps", &options.interval_steps)
      .at_least(1)
      .help("steps between frames, when output.interval_time is 0");
  table.add("output.fields", &options.fields)
      .help("fields of the drawn surface; all unless given; vertex_id, rank and cell_id are always there");
  table.add("output.springs", &options.springs)
      .help("also write the springs of a sheet as lines, <name>_springs.pvd: colour set, strain, target length, state");
  table.add("output.monitor", &options.monitor)
      .at_least(0)
      .help(
          "print a progress line every so many steps, also when the output is no terminal; 0: every step on a "
          "terminal, nothing elsewhere");
}

}  // namespace pellicle
