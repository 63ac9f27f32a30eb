#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "projection/successive_projection.h"
#include "surface/shell.h"
#include "tests/support/by_id.h"
#include "tests/support/print_once.h"

namespace pellicle {

/// A sheet of given particles and springs on this rank alone, at rest where it stands, masses 1.
inline Sheet hand_made_sheet(const Eigen::Matrix3Xd& rest,
                             const std::map<Colour, std::vector<std::array<PetscInt, 2>>>& springs) {
  Sheet sheet;
  const auto set_layout = [](Layout& layout, std::size_t count) {
    layout.comm = PETSC_COMM_SELF;
    layout.owned = layout.global = static_cast<PetscInt>(count);
  };
  const auto count = static_cast<std::size_t>(rest.cols());
  set_layout(sheet.particles, count);
  sheet.rest = rest;
  sheet.initial_mass.assign(count, 1);
  sheet.is_lattice.assign(count, false);
  for (std::size_t i = 0; i < count; ++i) {
    sheet.persistent_id.push_back(static_cast<PetscInt>(i));
  }
  sheet.owned_corners = sheet.first_lattice_id = static_cast<PetscInt>(count);
  for (const Colour colour : all_colours) {
    SpringSet& set = sheet.of(colour);
    if (springs.count(colour) > 0) {
      set.ends = springs.at(colour);
    }
    set_layout(set.layout, set.ends.size());
    for (const auto& [a, b] : set.ends) {
      set.initial_length.push_back((rest.col(a) - rest.col(b)).norm());
    }
  }
  return sheet;
}

/// Springs that all live.
inline std::vector<bool> all_of(const SpringSet& springs) { return std::vector<bool>(springs.ends.size(), true); }

/// A sheet with all that a projection reads: at rest and free until a test changes it.
struct Scene {
  explicit Scene(Sheet made) : sheet(std::move(made)), x(sheet.particles, 3), mass(sheet.initial_mass), active(sheet) {
    x.values() = sheet.rest;
    pinned.assign(mass.size(), false);
    for (std::size_t colour = 0; colour < 4; ++colour) {
      target[colour] = sheet.springs[colour].initial_length;
    }
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  ProjectionInput input() const { return {target, mass, pinned, active}; }

  void scale_targets(Colour colour, double factor) {
    for (double& length : target[static_cast<std::size_t>(colour)]) {
      length *= factor;
    }
  }

  Sheet sheet;
  Field x;
  std::array<std::vector<double>, 4> target;
  std::vector<double> mass;
  std::vector<bool> pinned;
  ActiveSet active;
};

/// Closed quad surface of the given unit cubes, each split into `parts` a side, edges 1/parts, normals outward.
inline SurfaceMesh cubes_mesh(const std::set<std::array<int, 3>>& cubes, int parts) {
  const auto is_filled = [&](std::array<int, 3> cell) {
    for (int& c : cell) {
      c = c < 0 ? -1 : c / parts;
    }
    return cubes.count(cell) > 0;
  };
  SurfaceMesh mesh;
  std::map<std::array<int, 3>, int> number;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [entry, is_new] = number.try_emplace(at, static_cast<int>(mesh.points.size()));
    if (is_new) {
      mesh.points.emplace_back(Eigen::Vector3d(at[0], at[1], at[2]) / parts);
    }
    return entry->second;
  };
  for (const auto& cube : cubes) {
    for (int index = 0; index < parts * parts * parts; ++index) {
      const std::array<int, 3> cell{cube[0] * parts + index % parts, cube[1] * parts + index / parts % parts,
                                    cube[2] * parts + index / parts / parts};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const int side : {0, 1}) {
          std::array<int, 3> neighbour = cell;
          neighbour[axis] += side == 1 ? 1 : -1;
          if (is_filled(neighbour)) {
            continue;
          }
          std::vector<int>& face = mesh.faces.emplace_back();
          for (const auto& [u, v] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
            std::array<int, 3> at = cell;
            at[axis] += side;
            at[(axis + 1) % 3] += u;
            at[(axis + 2) % 3] += v;
            face.push_back(vertex(at));
          }
          if (side == 0) {
            std::reverse(face.begin(), face.end());
          }
        }
      }
    }
  }
  return mesh;
}

/// A closed surface with vertices of valence 3, 4, 5 and 6: a cube with a neighbour on three of its sides.
inline SurfaceMesh tripod_mesh(int parts) { return cubes_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, parts); }

/// Solves as exact as iterations get, nothing regularised, all steps done.
inline ProjectOptions tight_options() {
  ProjectOptions options;
  options.ksp_rtol = 1e-13;
  options.shift = 0;
  options.threshold = 0;
  return options;
}

}  // namespace pellicle
