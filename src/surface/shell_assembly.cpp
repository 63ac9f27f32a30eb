#include "surface/shell_assembly.h"

#include <algorithm>
#include <array>

#include "parallel/collective.h"
#include "parallel/exchange.h"

namespace pellicle {
inline namespace surface {

namespace {

/// A spring found at a cell, before owned springs are sorted to the front. A spring at a side of two cells is found at
/// the cell of the lesser id.
struct FoundSpring {
  PetscInt cell;
  PetscInt index;  ///< among the springs of this colour at the cell, 0 to 3
  std::array<PetscInt, 2> ends;
  std::array<PetscInt, 4> triangles;  ///< SpringSet::triangles
};

/// Orders springs owned first, numbers them, and drops those that neither end at a particle of this rank, nor share one
/// with an owned spring, nor lie in an owned cell. Collective.
SpringSet make_spring_set(const std::vector<FoundSpring>& found, const Distribution& distribution, const Sheet& sheet) {
  SpringSet set;
  constexpr std::size_t springs_of_a_cell = 4;  // at most, of a colour
  std::vector<std::array<PetscInt, springs_of_a_cell>> number(distribution.cells().end, {-1, -1, -1, -1});
  std::vector<bool> needed(sheet.particles.local(), false);
  std::fill_n(needed.begin(), sheet.particles.owned, true);
  const auto number_of = [&number](const FoundSpring& spring) -> PetscInt& {
    return number[spring.cell][spring.index];
  };
  const auto add = [&](const FoundSpring& spring) {
    set.ends.push_back(spring.ends);
    set.triangles.push_back(spring.triangles);
    set.initial_length.push_back((sheet.rest.col(spring.ends[0]) - sheet.rest.col(spring.ends[1])).norm());
  };
  set.ends.reserve(found.size());
  set.triangles.reserve(found.size());
  set.initial_length.reserve(found.size());
  for (const FoundSpring& spring : found) {
    if (distribution.is_owned(spring.cell)) {
      number_of(spring) = static_cast<PetscInt>(set.ends.size());
      add(spring);
      needed[spring.ends[0]] = true;
      needed[spring.ends[1]] = true;
    }
  }
  set.layout = number_owned(sheet.comm(), static_cast<PetscInt>(set.ends.size()));
  for (auto& of_cell : number) {
    for (PetscInt& n : of_cell) {
      n += n >= 0 ? set.layout.first : 0;
    }
  }
  update_ghosts(distribution.cell_layout(), number);
  for (const FoundSpring& spring : found) {
    const bool is_needed = needed[spring.ends[0]] || needed[spring.ends[1]] ||
                           std::any_of(spring.triangles.begin(), spring.triangles.end(), [&sheet](PetscInt triangle) {
                             return triangle >= 0 && triangle < 4 * sheet.elements.owned;
                           });
    if (!distribution.is_owned(spring.cell) && is_needed) {
      set.layout.ghost_global.push_back(number_of(spring));
      add(spring);
    }
  }
  return set;
}

}  // namespace

AssembledShell assemble_shell(const Distribution& distribution) {
  AssembledShell shell;
  Sheet& sheet = shell.sheet;

  // Particles: owned corners, owned lattice points, ghost corners, ghost lattice points.
  const Distribution::Range cells = distribution.cells();
  std::vector<PetscInt> particle_of_point(distribution.points(), -1);
  for (const bool owned : {true, false}) {
    for (const Distribution::Range& range : {distribution.vertices(), cells}) {
      for (PetscInt point = range.begin; point < range.end; ++point) {
        if (distribution.is_owned(point) == owned) {
          const bool is_lattice = point >= cells.begin && point < cells.end;
          particle_of_point[point] = static_cast<PetscInt>(shell.points.size());
          shell.points.push_back(point);
          sheet.is_lattice.push_back(is_lattice);
          sheet.owned_corners += owned && !is_lattice ? 1 : 0;
        }
      }
    }
  }
  distribution.fill(sheet, shell.points);
  for (const PetscInt point : shell.points) {
    sheet.initial_mass.push_back(distribution.data(point).mass);
  }

  // Cells, in the order of the distribution, and the springs that belong to a cell.
  sheet.elements = distribution.cell_layout();
  sheet.triangles_per_element = 4;
  const std::vector<int> piece = distribution.find_pieces(sheet.piece_is_closed);
  std::vector<FoundSpring> red;
  std::vector<FoundSpring> yellow;
  const std::size_t all_cells = cells.end - cells.begin;
  red.reserve(4 * all_cells);
  yellow.reserve(2 * all_cells);
  sheet.triangles.reserve(4 * all_cells);
  std::vector<PetscInt> cell_of_point(distribution.points(), -1);
  sheet.cell_count.assign(sheet.particles.owned, 0);
  for (const bool owned : {true, false}) {
    for (PetscInt point = cells.begin; point < cells.end; ++point) {
      if (distribution.is_owned(point) != owned) {
        continue;
      }
      const PetscInt lattice = particle_of_point[point];
      const auto triangle = 4 * static_cast<PetscInt>(sheet.cells.size());
      const std::array<PetscInt, 4> triangles{triangle, triangle + 1, triangle + 2, triangle + 3};
      std::array<PetscInt, 4> corners = distribution.corners<4>(point);
      for (std::size_t k = 0; k < 4; ++k) {
        corners[k] = particle_of_point[corners[k]];
        red.push_back(
            {point, static_cast<PetscInt>(k), {corners[k], lattice}, {triangles[k], triangles[(k + 3) % 4], -1, -1}});
        if (corners[k] < sheet.owned_corners) {
          ++sheet.cell_count[corners[k]];
        }
      }
      yellow.push_back({point, 0, {corners[0], corners[2]}, triangles});
      yellow.push_back({point, 1, {corners[1], corners[3]}, triangles});
      cell_of_point[point] = static_cast<PetscInt>(sheet.cells.size());
      for (std::size_t k = 0; k < 4; ++k) {
        sheet.triangles.push_back({corners[k], corners[(k + 1) % 4], lattice});
      }
      sheet.piece.push_back(piece[point]);
      sheet.cells.push_back(corners);
      sheet.lattice.push_back(lattice);
      sheet.element_mass.push_back(2 * sheet.initial_mass[lattice]);
    }
  }

  // Springs along and across the sides of the cells.
  std::vector<FoundSpring> blue;
  std::vector<FoundSpring> green;
  blue.reserve(4 * all_cells);
  green.reserve(2 * all_cells);
  for (PetscInt point = cells.begin; point < cells.end; ++point) {
    const PetscInt cell = cell_of_point[point];
    for (PetscInt k = 0; k < 4; ++k) {
      const PetscInt opposite = distribution.opposite()[4 * point + k];
      const bool is_inner = opposite >= 0;
      const PetscInt beyond = opposite / 4;
      if (is_inner && distribution.data(beyond).id < distribution.data(point).id) {
        continue;
      }
      const auto& corners = sheet.cells[cell];
      const PetscInt other = is_inner ? cell_of_point[beyond] : -1;
      const std::array<PetscInt, 4> triangles{4 * cell + k, is_inner ? 4 * other + opposite % 4 : -1, -1, -1};
      blue.push_back({point, k, {corners[k], corners[(k + 1) % 4]}, triangles});
      if (is_inner) {
        green.push_back({point, k, {sheet.lattice[cell], sheet.lattice[other]}, triangles});
      }
    }
  }
  sheet.global_corners = sum_over_ranks(distribution.comm(), sheet.owned_corners);
  sheet.of(Colour::red) = make_spring_set(red, distribution, sheet);
  sheet.of(Colour::green) = make_spring_set(green, distribution, sheet);
  sheet.of(Colour::blue) = make_spring_set(blue, distribution, sheet);
  sheet.of(Colour::yellow) = make_spring_set(yellow, distribution, sheet);
  return shell;
}

}  // namespace surface
}  // namespace pellicle
