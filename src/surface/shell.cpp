#include "surface/shell.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/sorting.h"
#include "geometry/pressure_load.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"
#include "surface/distribution.h"

namespace pellicle::surface {

namespace {

/// Gives the cells of a mesh the ids of their lattice points. Collective.
SheetIds number_lattice(Distribution& mesh) {
  std::array<PetscInt, 2> last{-1, -1};  // ids of vertices and cells
  for (PetscInt point = 0; point < mesh.points(); ++point) {
    PetscInt& of_kind = last[point < mesh.cells() ? 1 : 0];
    of_kind = std::max(of_kind, mesh.data(point).id);
  }
  last = max_over_ranks(mesh.comm(), last);
  const PetscInt first_lattice_id = last[0] + 1;
  for (PetscInt cell = 0; cell < mesh.cells(); ++cell) {
    mesh.data(cell).id += first_lattice_id;
  }
  return {first_lattice_id, first_lattice_id + last[1] + 1};
}

/// Computes places and masses of the lattice points of the local cells from the corners' places. Not collective.
void place_lattice(Distribution& mesh, const SheetOptions& options) {
  for (PetscInt cell = 0; cell < mesh.cells(); ++cell) {
    const std::array<PetscInt, 4> corners = mesh.corners<4>(cell);
    const auto position = [&](std::size_t k) {
      return Eigen::Map<const Eigen::Vector3d>(mesh.data(corners[k]).position.data());
    };
    const Eigen::Vector3d area = quad_area_vector(position(0), position(1), position(2), position(3));
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      place += position(k) / 4;
    }
    MeshRows::Point& lattice = mesh.data(cell);
    const double offset = options.is_one_surface || options.layers == 1 ? 0 : options.thickness;
    lattice.mass = options.areal_density * area.norm() / 2;
    Eigen::Map<Eigen::Vector3d>(lattice.position.data()) = place + offset * area.normalized();
  }
}

/// Gives corners their masses, an eighth of the mass of each cell; half of a cell's mass belongs to its lattice point.
/// Collective.
void add_corner_masses(Distribution& mesh) {
  // In the order of the ids, so that rounding does not depend on the ranks: all cells at an owned vertex are
  // constrained.
  std::vector<PetscInt> ids;
  for (PetscInt cell = 0; cell < mesh.cells(); ++cell) {
    ids.push_back(mesh.data(cell).id);
  }
  for (const PetscInt cell : ordered_by(ids)) {
    for (const PetscInt corner : mesh.corners<4>(cell)) {
      mesh.data(corner).mass += mesh.data(cell).mass / 4;
    }
  }
  update_ghosts(mesh.cell_layout, mesh.rows.cells);
  update_ghosts(mesh.vertex_layout, mesh.rows.vertices);
}

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
SpringSet make_spring_set(const std::vector<FoundSpring>& found, const Distribution& mesh, const Sheet& sheet) {
  SpringSet set;
  constexpr std::size_t springs_of_a_cell = 4;  // at most, of a colour
  std::vector<std::array<PetscInt, springs_of_a_cell>> number(mesh.cells(), {-1, -1, -1, -1});
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
    if (mesh.is_owned(spring.cell)) {
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
  update_ghosts(mesh.cell_layout, number);
  for (const FoundSpring& spring : found) {
    const bool is_needed = needed[spring.ends[0]] || needed[spring.ends[1]] ||
                           std::any_of(spring.triangles.begin(), spring.triangles.end(), [&sheet](PetscInt triangle) {
                             return triangle >= 0 && triangle < 4 * sheet.elements.owned;
                           });
    if (!mesh.is_owned(spring.cell) && is_needed) {
      set.layout.ghost_global.push_back(number_of(spring));
      add(spring);
    }
  }
  return set;
}

/// Makes particles, cells and springs. Collective. @param mesh that of a sheet, with `shell_layers`
LoadedSheet assembled(const Distribution& mesh, const SheetIds& ids, const SheetOptions& options) {
  Sheet sheet;
  sheet.layers = options.layers;
  sheet.first_lattice_id = ids.first_lattice_id;
  sheet.id_end = ids.id_end;

  // Particles: owned corners, owned lattice points, ghost corners, ghost lattice points.
  std::vector<PetscInt> points;  // cell or vertex of each local particle
  std::vector<PetscInt> particle_of_point(mesh.points(), -1);
  for (const bool owned : {true, false}) {
    for (const bool is_lattice : {false, true}) {
      const PetscInt end = is_lattice ? mesh.cells() : mesh.points();
      for (PetscInt point = is_lattice ? 0 : mesh.cells(); point < end; ++point) {
        if (mesh.is_owned(point) == owned) {
          particle_of_point[point] = static_cast<PetscInt>(points.size());
          points.push_back(point);
          sheet.is_lattice.push_back(is_lattice);
          sheet.initial_mass.push_back(mesh.data(point).mass);
          sheet.owned_corners += owned && !is_lattice ? 1 : 0;
        }
      }
    }
  }
  mesh.fill(sheet, points);

  // Cells, in the order of the distribution, and the springs of each colour.
  sheet.elements = mesh.cell_layout;
  sheet.triangles_per_element = 4;
  sheet.piece = mesh.find_pieces(sheet.piece_is_closed);
  sheet.cell_count.assign(sheet.particles.owned, 0);
  sheet.triangles.reserve(4 * sheet.piece.size());
  std::array<std::vector<FoundSpring>, 4> found;
  auto& [red, green, blue, yellow] = found;
  red.reserve(4 * sheet.piece.size());
  green.reserve(2 * sheet.piece.size());
  blue.reserve(4 * sheet.piece.size());
  yellow.reserve(2 * sheet.piece.size());
  for (PetscInt cell = 0; cell < mesh.cells(); ++cell) {
    const PetscInt lattice = particle_of_point[cell];
    const std::array<PetscInt, 4> triangles{4 * cell, 4 * cell + 1, 4 * cell + 2, 4 * cell + 3};
    std::array<PetscInt, 4> corners = mesh.corners<4>(cell);
    for (PetscInt& corner : corners) {
      corner = particle_of_point[corner];
      if (corner < sheet.owned_corners) {
        ++sheet.cell_count[corner];
      }
    }
    for (PetscInt k = 0; k < 4; ++k) {
      const PetscInt next = corners[(k + 1) % 4];
      sheet.triangles.push_back({corners[k], next, lattice});
      red.push_back({cell, k, {corners[k], lattice}, {triangles[k], triangles[(k + 3) % 4], -1, -1}});
      const PetscInt opposite = mesh.opposite[triangles[k]];
      const PetscInt beyond = opposite / 4;
      if (opposite < 0) {
        blue.push_back({cell, k, {corners[k], next}, {triangles[k], -1, -1, -1}});
      } else if (mesh.data(beyond).id >= mesh.data(cell).id) {
        blue.push_back({cell, k, {corners[k], next}, {triangles[k], opposite, -1, -1}});
        green.push_back({cell, k, {lattice, particle_of_point[beyond]}, {triangles[k], opposite, -1, -1}});
      }
    }
    yellow.push_back({cell, 0, {corners[0], corners[2]}, triangles});
    yellow.push_back({cell, 1, {corners[1], corners[3]}, triangles});
    sheet.cells.push_back(corners);
    sheet.lattice.push_back(lattice);
    sheet.element_id.push_back(mesh.data(cell).id - ids.first_lattice_id);
    sheet.element_mass.push_back(2 * sheet.initial_mass[lattice]);
  }
  for (const Colour colour : all_colours) {
    sheet.of(colour) = make_spring_set(found[colour], mesh, sheet);
  }
  return {std::move(sheet), mesh.particle_data(points), mesh.rows.cell_data};
}

/// Sum of the undeformed lengths of the springs of a colour over all ranks [m]. Collective.
double sum_of_lengths(const SpringSet& springs) {
  const auto begin = springs.initial_length.begin();
  return sum_over_ranks(springs.layout.comm, std::accumulate(begin, begin + springs.owned(), 0.0));
}

/// Refuses springs whose undeformed length is rounding, since strains are relative to it. Two cells have such a spring
/// between them where the sheet is folded flat at their common side. Collective. @throws Error
void require_lengths(const Sheet& sheet) {
  constexpr double least = 1e-6;  // of the colour's mean length
  constexpr PetscInt none = std::numeric_limits<PetscInt>::max();
  std::array<PetscInt, 2> first{none, none};  // ids of the ends of the lowest such spring
  for (const Colour colour : all_colours) {
    const SpringSet& springs = sheet.of(colour);
    const double sum = sum_of_lengths(springs);
    for (PetscInt s = 0; s < springs.owned() && sheet.acts(colour); ++s) {
      if (springs.initial_length[s] * static_cast<double>(springs.layout.global) <= least * sum) {
        const auto [a, b] = springs.ends[s];
        const auto [lesser, greater] = std::minmax(sheet.persistent_id[a], sheet.persistent_id[b]);
        first = std::min(first, {lesser, greater});
      }
    }
  }
  const std::vector<std::array<PetscInt, 2>> of_ranks = of_all_ranks(sheet.comm(), std::vector{first});
  first = *std::min_element(of_ranks.begin(), of_ranks.end());
  if (first[0] == none) {
    return;
  }
  const auto place = [&sheet](PetscInt id) {
    return id < sheet.first_lattice_id ? "vertex " + std::to_string(id)
                                       : "the middle of cell " + std::to_string(id - sheet.first_lattice_id);
  };
  const bool is_fold = first[0] >= sheet.first_lattice_id;
  throw Error("mesh: " + place(first[0]) + " and " + place(first[1]) + " (numbers from 0) lie at one place, expected " +
              (is_fold ? "less than 180 degrees between neighbouring cells: the undeformed sheet is folded flat on "
                         "itself at their common side"
                       : "a distance between them"));
}

}  // namespace

Sheet make_sheet(MPI_Comm comm, MeshRows mesh, const SheetOptions& options) {
  Distribution distribution(comm, std::move(mesh), shell_layers, Numbering::by_id_unless_scattered, options);
  const SheetIds ids = number_lattice(distribution);
  place_lattice(distribution, options);
  add_corner_masses(distribution);
  Sheet sheet = assembled(distribution, ids, options).sheet;
  require_lengths(sheet);
  return sheet;
}

LoadedSheet make_sheet(MPI_Comm comm, MeshRows rows, const SheetIds& ids, const SheetOptions& options) {
  Distribution distribution(comm, std::move(rows), shell_layers, Numbering::by_id_unless_scattered, options);
  place_lattice(distribution, options);
  return assembled(distribution, ids, options);
}

MeshRows rows_of(const Sheet& sheet, const std::vector<bool>& kept, const Records& particles, const Records& cells) {
  MeshRows rows = vertex_rows(sheet, sheet.owned_corners);
  rows.corners = 4;
  for (PetscInt corner = 0; corner < sheet.owned_corners; ++corner) {
    rows.vertices[corner].mass = sheet.initial_mass[corner];
  }
  std::vector<PetscInt> kept_cells;
  std::vector<PetscInt> lattice;
  for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
    if (kept.empty() || kept[cell]) {
      kept_cells.push_back(cell);
      lattice.push_back(sheet.lattice[cell]);
      rows.cells.push_back(row_of(sheet, lattice.back()));
      for (const PetscInt corner : sheet.cells[cell]) {
        rows.cell_corners.push_back(sheet.persistent_id[corner]);
      }
    }
  }
  set_groups(sheet.comm(), rows, sheet.groups, {});
  rows.part.assign(kept_cells.size(), rank_of(sheet.comm()));
  rows.vertex_data = particles.of_items(numbers_up_to<PetscInt>(sheet.owned_corners));
  rows.lattice_data = particles.of_items(lattice);
  rows.cell_data = cells.of_items(kept_cells);
  return rows;
}

MeshRows rows_of_mesh(const Sheet& sheet) {
  MeshRows rows = rows_of(sheet, {}, {}, {});
  for (MeshRows::Point& cell : rows.cells) {
    cell.id -= sheet.first_lattice_id;
  }
  for (MeshRows::Point& vertex : rows.vertices) {
    vertex.mass = 0;
  }
  return rows;
}

LoadedSheet compact(const Sheet& sheet, const std::vector<bool>& kept, const Records& particles, const Records& cells,
                    const SheetOptions& options) {
  MeshRows rows = rows_of(sheet, kept, particles, cells);
  const RankShares shares = shares_of_ranks(sheet.comm(), static_cast<double>(rows.cells.size()));
  if (shares.imbalance > options.imbalance_limit) {
    rows.part.clear();
  }
  return make_sheet(sheet.comm(), std::move(rows), {sheet.first_lattice_id, sheet.id_end}, options);
}

LoadedSheet spread(const Sheet& sheet, const std::vector<double>& load, const Records& particles, const Records& cells,
                   const SheetOptions& options) {
  std::vector<double> fraction = load;  // of each element at a particle
  for (std::size_t i = 0; i < fraction.size(); ++i) {
    fraction[i] /= std::max(sheet.cell_count[i], 1);
  }
  fraction.resize(sheet.particles.local());
  update_ghosts(sheet.particles, fraction);
  const auto of = [&fraction](PetscInt particle) { return fraction[particle]; };
  MeshRows rows = rows_of(sheet, {}, particles, cells);
  rows.part.clear();
  for (std::size_t cell = 0; cell < rows.cells.size(); ++cell) {
    const std::array<PetscInt, 4>& corners = sheet.cells[cell];
    rows.load.push_back(std::accumulate(corners.begin(), corners.end(), of(sheet.lattice[cell]),
                                        [&of](double sum, PetscInt corner) { return sum + of(corner); }));
  }
  return make_sheet(sheet.comm(), std::move(rows), {sheet.first_lattice_id, sheet.id_end}, options);
}

LoadedSheet split(const Sheet& sheet, const SplitCorners& corners, const Records& particles, const Records& copies,
                  const Records& cells, const SheetOptions& options) {
  return make_sheet(sheet.comm(), split(rows_of(sheet, {}, particles, cells), corners, copies),
                    {sheet.first_lattice_id, corners.id_end}, options);
}

Eigen::Matrix3Xd perturbed_positions(const Sheet& sheet, const SheetOptions& options) {
  const SpringSet& blue = sheet.of(Colour::blue);
  return perturbed_positions(sheet, options, sum_of_lengths(blue) / static_cast<double>(blue.layout.global));
}

}  // namespace pellicle::surface
