#pragma once

#include <array>
#include <string>

namespace pellicle {

class OptionTable;

/// Successive fast projection (burning paper, section 7).
struct ProjectOptions {
  int max_steps = 7;        ///< full projection steps, each of the four colours in turn
  double threshold = 1e-7;  ///< of ||C|| over all springs [m]
  double error_limit = 1;   ///< of ||C|| / ||l||, beyond which the projection has failed
  std::string order = "RGBY";
  std::string masses = "true";
  std::string pins = "exact";
  double shift = 1e-2;
  std::array<double, 4> weight{1, 1, 1, 1};  ///< w of each colour, eq. 19
  std::string weight_texture;                ///< a PNG whose brightness multiplies the weights of the springs
  std::string mat_type = "lines";
  double ksp_rtol = 1e-3;
  bool monitor = false;
};

void describe(OptionTable& table, ProjectOptions& options);

}  // namespace pellicle
