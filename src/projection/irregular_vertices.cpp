#include "projection/irregular_vertices.h"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/units.h"
#include "parallel/collective.h"
#include "surface/incidence.h"

namespace pellicle {
inline namespace projection {

namespace {

constexpr int most_neighbours = 6;     // Burning paper, section 8.2.
constexpr double least_shift = 0.001;  // Measured with 12 neighbours: steps fail at 1e-4, none at 1e-3.

}  // namespace

void require_shift_at_irregular_vertices(const Sheet& sheet, const ProjectOptions& options) {
  if (options.shift >= least_shift) {
    return;
  }
  std::vector<PetscInt> most(sheet.particles.owned, 0);
  for (const Colour colour : all_colours) {
    if (!sheet.acts(colour)) {
      continue;
    }
    const Incidence incidence(sheet.of(colour).ends, sheet.particles.local());
    for (std::size_t i = 0; i < most.size(); ++i) {
      most[i] = std::max(most[i], incidence[static_cast<PetscInt>(i)].size());
    }
  }
  const PetscInt largest = max_over_ranks(sheet.comm(), most.empty() ? 0 : *std::max_element(most.begin(), most.end()));
  if (largest <= most_neighbours) {
    return;
  }
  PetscInt vertex = std::numeric_limits<PetscInt>::max();
  for (std::size_t i = 0; i < most.size(); ++i) {
    vertex = most[i] == largest ? std::min(vertex, sheet.persistent_id[i]) : vertex;
  }
  vertex = min_over_ranks(sheet.comm(), vertex);
  throw Error("project.shift: " + number_text(options.shift) + ", expected at least " + number_text(least_shift) +
              " as vertex " + std::to_string(vertex) + " has " + std::to_string(largest) +
              " neighbours by springs of one colour: beyond six the projection diverges without it");
}

}  // namespace projection
}  // namespace pellicle
