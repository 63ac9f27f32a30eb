#include "io/output_options.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "base/error.h"
#include "options/options.h"

namespace pellicle::io {

namespace {

bool is_control(char letter) { return std::iscntrl(static_cast<unsigned char>(letter)) != 0; }

/// Whether every byte beyond ASCII is part of a character in UTF-8.
bool is_utf8(const std::string& text) {
  std::size_t more = 0;  // bytes that belong to the present character
  for (const char letter : text) {
    const auto byte = static_cast<unsigned char>(letter);
    const bool continues = (byte & 0xC0U) == 0x80U;
    if (continues != (more > 0) || byte > 0xF4U) {
      return false;
    }
    if (continues) {
      --more;
    } else {
      more = byte < 0x80U ? 0 : byte < 0xE0U ? 1 : byte < 0xF0U ? 2 : 3;
    }
  }
  return more == 0;
}

}  // namespace

void OutputOptions::name_after(const std::string& deck) {
  if (name.empty()) {
    name = std::filesystem::path(deck).stem().string();
  }
  if (directory.empty()) {
    directory = "output/" + name;
  }
}

void OutputOptions::validate() const {
  // The name is the first part of the names of files, a line of the list of files, and stands in the XML of the .pvd.
  constexpr std::size_t longest = 200;
  const bool is_name = !name.empty() && name.size() <= longest && name.front() != '.' && name.front() != '-' &&
                       name.front() != ' ' && name.back() != ' ' &&
                       name.find_first_of("/\\&<>\"'") == std::string::npos &&
                       std::none_of(name.begin(), name.end(), is_control) && is_utf8(name);
  if (!is_name) {
    throw Error("output.name: '" + name + "'" +
                " cannot be the name of a file: expected letters, digits, '_', '-' or '.'");
  }
  if (std::any_of(directory.begin(), directory.end(), is_control)) {
    throw Error("output.directory: '" + directory + "'" + " has control characters: expected the name of a folder");
  }
}

void describe(OptionTable& table, OutputOptions& options) {
  table.add("output.directory", options.directory,
            "folder of all files that the run writes, one run at a time; output/<name of the deck> unless given; files "
            "of an earlier run of the same name are replaced, see its run_files.txt, others are left alone");
  table.add("output.name", options.name,
            "name of the run: of the .pvd file and of its frames; the deck's unless given");
  table.add("output.interval_time", options.interval_time, Rules("s").at_least(0),
            "simulated time between frames; 0: output.interval_steps counts");
  table.add(
      "output.interval_steps", options.interval_steps,
      Rules().at_least(1).acts_with({"output.interval_time: 0", [&options] { return options.interval_time == 0; }}),
      "steps between frames");
  table.add("output.fields", options.fields,
            "fields of the drawn surface; all unless given; vertex_id, rank and cell_id are always there");
  table.add("output.springs", options.springs,
            "also write the springs of a sheet as lines, <name>_springs.pvd: colour set, strain, target length, state");
  table.add("output.monitor", options.monitor, Rules().at_least(0),
            "print a progress line every so many steps, also when the output is no terminal; 0: every step on a "
            "terminal, elsewhere one after five minutes without a line");
}

}  // namespace pellicle::io
