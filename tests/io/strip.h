#pragma once

#include <mpi.h>

#include <array>
#include <vector>

#include "surface/drawn_surface.h"
#include "surface/membrane.h"
#include "surface/sheet.h"

namespace pellicle {

/// The whole of a membrane as it is drawn: the triangles of the rank's own elements, and their vertices.
inline DrawnSurface whole_surface(const Membrane& membrane) {
  DrawnSurface surface;
  std::vector<PetscInt> number(membrane.persistent_id.size(), -1);
  for (PetscInt element = 0; element < membrane.elements.owned; ++element) {
    std::array<PetscInt, 3> triangle = membrane.triangles[element];
    for (PetscInt& corner : triangle) {
      PetscInt& point = number[corner];
      if (point < 0) {
        point = static_cast<PetscInt>(surface.points.size());
        surface.points.push_back(
            {{{corner}, {1}}, membrane.persistent_id[corner], corner < membrane.particles.owned, 0, 0});
      }
      corner = point;
    }
    surface.triangles.push_back(triangle);
    surface.elements.push_back(element);
  }
  return surface;
}

/// The whole of a sheet as it is drawn: the corners of the rank's own cells, the virtual centres, four triangles a
/// cell.
inline DrawnSurface whole_surface(const Sheet& sheet) {
  DrawnSurface surface;
  std::vector<PetscInt> number(sheet.persistent_id.size(), -1);
  const auto add = [&](PetscInt of, std::array<PetscInt, 4> particles, std::array<double, 4> weights, double centre) {
    number[of] = static_cast<PetscInt>(surface.points.size());
    surface.points.push_back({{particles, weights}, sheet.persistent_id[of], of < sheet.particles.owned, of, centre});
  };
  for (const auto& round : sheet.cells) {
    for (const PetscInt corner : round) {
      if (number[corner] < 0) {
        add(corner, {corner}, {1}, 0);
      }
    }
  }
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    add(sheet.lattice[cell], sheet.cells[cell], {0.25, 0.25, 0.25, 0.25}, 1);
    for (std::size_t k = 0; k < 4; ++k) {
      surface.triangles.push_back(
          {number[sheet.cells[cell][k]], number[sheet.cells[cell][(k + 1) % 4]], number[sheet.lattice[cell]]});
      surface.elements.push_back(static_cast<PetscInt>(cell));
    }
  }
  return surface;
}

/// A strip of unit cells along x, made by hand: `cells` cells in one row, corner i at (i/2, i%2, 0), spread over the
/// ranks in equal runs, none on rank `empty` (no rank if negative). A corner belongs to the lowest rank that uses it.
/// Lattice points lie 0.1 above; one red spring a cell joins its first corner and its lattice point, one blue spring a
/// cell its first two corners.
inline Sheet make_strip(MPI_Comm comm, PetscInt cells, int empty = -1) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  std::vector<int> working;
  for (int r = 0; r < ranks; ++r) {
    if (r != empty || ranks == 1) {
      working.push_back(r);
    }
  }
  const auto workers = static_cast<PetscInt>(working.size());
  PetscInt first_cell = 0;
  PetscInt end_cell = 0;
  bool starts_strip = false;
  for (PetscInt i = 0; i < workers; ++i) {
    if (working[i] == rank) {
      first_cell = cells * i / workers;
      end_cell = cells * (i + 1) / workers;
      starts_strip = i == 0;
    }
  }
  Sheet sheet;
  sheet.particles.comm = comm;
  sheet.elements.global = cells;
  sheet.first_lattice_id = 2 * (cells + 1);  // the number of corners
  const bool has_cells = end_cell > first_cell;
  std::vector<PetscInt> corners;  // persistent ids of the owned ones
  if (has_cells) {
    for (PetscInt i = starts_strip ? 0 : 2 * (first_cell + 1); i < 2 * (end_cell + 1); ++i) {
      corners.push_back(i);
    }
  }
  sheet.persistent_id = corners;
  sheet.owned_corners = static_cast<PetscInt>(corners.size());
  for (PetscInt cell = first_cell; cell < end_cell; ++cell) {
    sheet.persistent_id.push_back(sheet.first_lattice_id + cell);
  }
  sheet.particles.owned = static_cast<PetscInt>(sheet.persistent_id.size());
  sheet.particles.global = sheet.first_lattice_id + cells;
  if (has_cells && !starts_strip) {
    for (const PetscInt ghost : {2 * first_cell, 2 * first_cell + 1}) {
      sheet.persistent_id.push_back(ghost);
      sheet.particles.ghost_global.push_back(ghost);  // Only its number of entries is read here.
    }
  }
  const auto local = [&sheet](PetscInt id) {
    for (std::size_t i = 0; i < sheet.persistent_id.size(); ++i) {
      if (sheet.persistent_id[i] == id) {
        return static_cast<PetscInt>(i);
      }
    }
    return PetscInt{-1};
  };
  const PetscInt count = sheet.particles.local();
  sheet.rest.resize(3, count);
  sheet.uv.resize(2, count);
  for (PetscInt i = 0; i < count; ++i) {
    const PetscInt id = sheet.persistent_id[i];
    const bool lattice = id >= sheet.first_lattice_id;
    sheet.is_lattice.push_back(lattice);
    if (lattice) {
      sheet.rest.col(i) << static_cast<double>(id - sheet.first_lattice_id) + 0.5, 0.5, 0.1;
    } else {
      sheet.rest.col(i) << static_cast<double>(id - id % 2) / 2, static_cast<double>(id % 2), 0;
    }
    sheet.uv.col(i) << sheet.rest(0, i) / static_cast<double>(cells), sheet.rest(1, i);
  }
  for (PetscInt cell = first_cell; cell < end_cell; ++cell) {
    const std::array<PetscInt, 4> round{local(2 * cell), local(2 * cell + 2), local(2 * cell + 3), local(2 * cell + 1)};
    sheet.cells.push_back(round);
    sheet.lattice.push_back(local(sheet.first_lattice_id + cell));
    sheet.element_id.push_back(cell);
    sheet.of(Colour::red).ends.push_back({round[0], sheet.lattice.back()});
    sheet.of(Colour::blue).ends.push_back({round[0], round[1]});
  }
  sheet.elements.owned = end_cell - first_cell;
  for (const Colour colour : {Colour::red, Colour::blue}) {
    sheet.of(colour).layout.owned = sheet.elements.owned;
  }
  return sheet;
}

}  // namespace pellicle
