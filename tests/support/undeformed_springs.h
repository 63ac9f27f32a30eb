#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "elastic/spring_potential.h"
#include "surface/sheet.h"

namespace pellicle {

/// Laws for SpringPotential::set of springs that have their initial lengths without force. The arguments must outlive
/// it. @param stiffness of the local springs by colour [N/m]
inline auto undeformed_springs(const Sheet& sheet, const std::array<std::vector<double>, 4>& stiffness) {
  return [&](Colour colour, std::size_t s) {
    return SpringPotential::Hooke{stiffness[static_cast<std::size_t>(colour)][s], sheet.of(colour).initial_length[s]};
  };
}

}  // namespace pellicle
