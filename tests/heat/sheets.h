#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdlib>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "heat/diffusion_graph.h"
#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/membrane.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {

inline constexpr double test_density = 0.08;  // [kg/m^2]

inline Sheet shell_of(const SurfaceMesh& mesh, double thickness) {
  SheetOptions options;
  options.thickness = thickness;
  options.areal_density = test_density;
  return make_sheet(PETSC_COMM_WORLD, mesh, options);
}

/// A membrane of this areal density that can burn. Collective.
inline Membrane membrane_of(const SurfaceMesh& mesh, double density = test_density) {
  Membrane membrane = make_membrane(PETSC_COMM_WORLD, mesh, SheetOptions());
  std::vector<double> mass;
  for (const std::array<PetscInt, 3>& triangle : membrane.triangles) {
    const auto [e12, e13] = edges_of(membrane.rest.data(), triangle);
    mass.push_back(density * e12.cross(e13).norm() / 2);
  }
  set_burnable(membrane, std::move(mass));
  return membrane;
}

inline Field rest_positions(const Surface& surface) {
  Field positions(surface.particles, 3);
  positions.values() = surface.rest;
  return positions;
}

/// Rest positions of a sheet that lies in the x-y plane, with the lattice points in the plane of the corners.
inline Field flat_positions(const Sheet& sheet) {
  Field positions = rest_positions(sheet);
  positions.values().row(2).setZero();
  return positions;
}

inline Field initial_masses(const Surface& surface) {
  Field mass(surface.particles, 1);
  mass.values() = Eigen::Map<const Eigen::RowVectorXd>(surface.initial_mass.data(), mass.values().cols());
  return mass;
}

/// A function of the rest position on the local particles.
inline Field field_of(const Surface& surface, const std::function<double(const Eigen::Vector3d&)>& function) {
  Field field(surface.particles, 1);
  for (PetscInt i = 0; i < surface.particles.local(); ++i) {
    field.data()[i] = function(surface.rest.col(i));
  }
  return field;
}

/// sum_j weight_ij (T_j - T_i) of the owned particles. @param values ghosts up to date, (1 x local)
inline Eigen::VectorXd inflow_of(const DiffusionGraph& graph, const Field& values) {
  Eigen::VectorXd sum;
  graph.add_up_inflow(values, sum);
  return sum.head(graph.capacity.size());
}

/// What is left when surface triangles die, chosen by their middle in the undeformed sheet: springs die with the last
/// triangle that shares them. Collective.
inline ActiveSet without(const Sheet& sheet, const std::function<bool(const Eigen::Vector3d&)>& is_dead) {
  ActiveSet active(sheet);
  for (std::size_t c = 0; c < sheet.cells.size(); ++c) {
    const auto corner = [&](std::size_t k) { return sheet.rest.col(sheet.cells[c][k % 4]); };
    const Eigen::Vector3d centre = (corner(0) + corner(1) + corner(2) + corner(3)) / 4;
    for (std::size_t k = 0; k < 4; ++k) {
      active.triangles[4 * c + k] = !is_dead((corner(k) + corner(k + 1) + centre) / 3);
    }
  }
  for (const Colour colour : all_colours) {
    const SpringSet& springs = sheet.of(colour);
    Field lives(springs.layout, 1);  // A ghost does not know all its triangles.
    for (PetscInt s = 0; s < springs.owned(); ++s) {
      for (const PetscInt triangle : springs.triangles[s]) {
        if (triangle >= 0 && active.triangles[triangle]) {
          lives.data()[s] = 1;
        }
      }
    }
    lives.update_ghosts();
    for (std::size_t s = 0; s < springs.ends.size(); ++s) {
      active.springs[static_cast<std::size_t>(colour)][s] = lives.data()[s] == 1;
    }
  }
  return active;
}

/// Folder `shared` beside the repository, or where the environment says it is.
inline std::string shared_folder() {
  const char* folder = std::getenv("PELLICLE_SHARED");
  return folder != nullptr ? folder : std::string(PELLICLE_SOURCE_DIR) + "/../shared";
}

}  // namespace pellicle
