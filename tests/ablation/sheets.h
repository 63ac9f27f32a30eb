#pragma once

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "parallel/collective.h"
#include "surface/active_set.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {

inline constexpr double test_density = 0.08;  // [kg/m^2]

inline Sheet shell_of(const SurfaceMesh& mesh, MPI_Comm comm = PETSC_COMM_WORLD) {
  SheetOptions options;
  options.thickness = 0.25;
  options.areal_density = test_density;
  return make_sheet(comm, mesh, options);
}

/// The persistent ids of a spring's ends, the smaller first.
using IdPair = std::pair<PetscInt, PetscInt>;

inline IdPair ids_of(const Sheet& sheet, Colour colour, PetscInt spring) {
  const auto [a, b] = sheet.of(colour).ends[spring];
  return std::minmax(sheet.persistent_id[a], sheet.persistent_id[b]);
}

/// Number in the whole sheet of a surface triangle.
inline PetscInt id_of_triangle(const Sheet& sheet, std::size_t triangle) {
  const auto lattice = static_cast<std::size_t>(sheet.lattice[triangle / 4]);
  return 4 * (sheet.persistent_id[lattice] - sheet.first_lattice_id) + static_cast<PetscInt>(triangle % 4);
}

/// A number for each local particle that depends on its persistent id alone.
inline std::vector<double> level_by_id(const Sheet& sheet, const std::function<double(PetscInt)>& level) {
  std::vector<double> levels;
  for (const PetscInt id : sheet.persistent_id) {
    levels.push_back(level(id));
  }
  return levels;
}

/// The same list on all ranks: that of all of them, in rising order. Collective.
template <class T>
std::vector<T> gathered(MPI_Comm comm, const std::vector<T>& own) {
  std::vector<T> all = of_all_ranks(comm, own);
  std::sort(all.begin(), all.end());
  return all;
}

inline Field initial_masses(const Sheet& sheet) {
  Field mass(sheet.particles, 1);
  std::copy(sheet.initial_mass.begin(), sheet.initial_mass.end(), mass.data());
  return mass;
}

}  // namespace pellicle
