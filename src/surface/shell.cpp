#include "surface/shell.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "geometry/quad_area.h"
#include "parallel/collective.h"
#include "surface/distribution.h"
#include "surface/perturbation.h"
#include "surface/shell_assembly.h"

namespace pellicle {
inline namespace surface {

namespace {

/// Gives the cells of a mesh the ids of their lattice points. Collective.
SheetIds number_lattice(Distribution& mesh) {
  const Distribution::Range cells = mesh.cells();
  const Distribution::Range vertices = mesh.vertices();
  std::array<PetscInt, 2> last{-1, -1};  // ids of vertices and cells
  for (PetscInt vertex = vertices.begin; vertex < vertices.end; ++vertex) {
    last[0] = std::max(last[0], mesh.data(vertex).id);
  }
  for (PetscInt cell = cells.begin; cell < cells.end; ++cell) {
    last[1] = std::max(last[1], mesh.data(cell).id);
  }
  last = max_over_ranks(mesh.comm(), last);
  const PetscInt first_lattice_id = last[0] + 1;
  for (PetscInt cell = cells.begin; cell < cells.end; ++cell) {
    mesh.data(cell).id += first_lattice_id;
  }
  return {first_lattice_id, first_lattice_id + last[1] + 1};
}

/// Computes places and masses of the lattice points of the local cells from the corners' places. Not collective.
void place_lattice(Distribution& mesh, const SheetOptions& options) {
  for (PetscInt cell = mesh.cells().begin; cell < mesh.cells().end; ++cell) {
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
  std::vector<PetscInt> by_id(mesh.cells().end);
  std::iota(by_id.begin(), by_id.end(), 0);
  std::sort(by_id.begin(), by_id.end(), [&mesh](PetscInt a, PetscInt b) { return mesh.data(a).id < mesh.data(b).id; });
  for (const PetscInt cell : by_id) {
    for (const PetscInt corner : mesh.corners<4>(cell)) {
      mesh.data(corner).mass += mesh.data(cell).mass / 4;
    }
  }
  mesh.update_data();
}

/// Makes a shell. @param rows those of a sheet
LoadedSheet assembled(const Distribution& rows, const SheetIds& ids, const SheetOptions& options) {
  AssembledShell shell = assemble_shell(rows);
  shell.sheet.layers = options.layers;
  shell.sheet.first_lattice_id = ids.first_lattice_id;
  shell.sheet.id_end = ids.id_end;
  std::vector<PetscInt> cells;
  for (const PetscInt lattice : shell.sheet.lattice) {
    cells.push_back(shell.points[lattice]);
    shell.sheet.element_id.push_back(shell.sheet.persistent_id[lattice] - ids.first_lattice_id);
  }
  return {std::move(shell.sheet), rows.particle_data(shell.points), rows.cell_data(cells)};
}

/// Refuses springs whose undeformed length is rounding, since strains are relative to it. Two cells have such a spring
/// between them where the sheet is folded flat at their common side. Collective. @throws Error
void require_lengths(const Sheet& sheet) {
  constexpr double least = 1e-6;  // of the colour's mean length
  constexpr PetscInt none = std::numeric_limits<PetscInt>::max();
  std::array<PetscInt, 2> first{none, none};  // ids of the ends of the lowest such spring
  for (const Colour colour : all_colours) {
    const SpringSet& springs = sheet.of(colour);
    const auto end = springs.initial_length.begin() + springs.owned();
    const double sum = sum_over_ranks(sheet.comm(), std::accumulate(springs.initial_length.begin(), end, 0.0));
    for (PetscInt s = 0; s < springs.owned() && sheet.acts(colour); ++s) {
      if (springs.initial_length[s] * static_cast<double>(springs.layout.global) <= least * sum) {
        std::array<PetscInt, 2> ids{};
        std::transform(springs.ends[s].begin(), springs.ends[s].end(), ids.begin(),
                       [&sheet](PetscInt i) { return sheet.persistent_id[i]; });
        std::sort(ids.begin(), ids.end());
        first = std::min(first, ids);
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

Sheet make_sheet(MPI_Comm comm, const SurfaceMesh& mesh, const SheetOptions& options) {
  return make_sheet(comm, rows_of(comm, mesh), options);
}

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
  int rank = 0;
  MPI_Comm_rank(sheet.comm(), &rank);
  MeshRows rows = vertex_rows(sheet, sheet.owned_corners);
  rows.corners = 4;
  for (PetscInt corner = 0; corner < sheet.owned_corners; ++corner) {
    rows.vertices[corner].mass = sheet.initial_mass[corner];
  }
  std::vector<PetscInt> corners(sheet.owned_corners);
  std::iota(corners.begin(), corners.end(), 0);
  std::vector<PetscInt> kept_cells;
  std::vector<PetscInt> lattice;
  for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
    if (kept[cell]) {
      kept_cells.push_back(cell);
      lattice.push_back(sheet.lattice[cell]);
      rows.cells.push_back(row_of(sheet, lattice.back()));
      for (const PetscInt corner : sheet.cells[cell]) {
        rows.cell_corners.push_back(sheet.persistent_id[corner]);
      }
    }
  }
  set_groups(sheet.comm(), rows, sheet.groups, {});
  rows.part.assign(kept_cells.size(), rank);
  rows.vertex_data = particles.of_items(corners);
  rows.lattice_data = particles.of_items(lattice);
  rows.cell_data = cells.of_items(kept_cells);
  return rows;
}

MeshRows rows_of_mesh(const Sheet& sheet) {
  MeshRows rows = rows_of(sheet, std::vector<bool>(sheet.elements.owned, true), {}, {});
  for (MeshRows::Point& cell : rows.cells) {
    cell.id -= sheet.first_lattice_id;
  }
  for (MeshRows::Point& vertex : rows.vertices) {
    vertex.mass = 0;
  }
  return rows;
}

Eigen::Matrix3Xd perturbed_positions(const Sheet& sheet, const SheetOptions& options) {
  const SpringSet& blue = sheet.of(Colour::blue);
  const auto end = blue.initial_length.begin() + blue.owned();
  const double sum = sum_over_ranks(sheet.comm(), std::accumulate(blue.initial_length.begin(), end, 0.0));
  return perturbed_positions(sheet, options, sum / static_cast<double>(blue.layout.global));
}

}  // namespace surface
}  // namespace pellicle
