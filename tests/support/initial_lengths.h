#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "surface/sheet.h"

namespace pellicle {

/// Of the local springs by colour [m].
inline std::array<std::vector<double>, 4> initial_lengths(const Sheet& sheet) {
  std::array<std::vector<double>, 4> lengths;
  for (std::size_t colour = 0; colour < lengths.size(); ++colour) {
    lengths[colour] = sheet.springs[colour].initial_length;
  }
  return lengths;
}

}  // namespace pellicle
