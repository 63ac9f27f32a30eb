#pragma once

#include <array>
#include <map>
#include <utility>

#include "gas/chambers.h"
#include "geometry/pressure_load.h"
#include "parallel/collective.h"
#include "parallel/field.h"
#include "surface/membrane.h"
#include "tests/support/balls.h"
#include "tests/support/pressure_action.h"

namespace pellicle {

/// Each triangle cut into four, new points in the middle of the edges.
inline SurfaceMesh refined(const SurfaceMesh& mesh) {
  SurfaceMesh result;
  result.points = mesh.points;
  std::map<std::pair<int, int>, int> middle_of_edge;
  const auto middle = [&](int a, int b) {
    const auto [entry, is_new] = middle_of_edge.try_emplace(std::minmax(a, b), static_cast<int>(result.points.size()));
    if (is_new) {
      result.points.emplace_back(0.5 * (mesh.points[a] + mesh.points[b]));
    }
    return entry->second;
  };
  for (const auto& face : mesh.faces) {
    const std::array<int, 3> centre{middle(face[0], face[1]), middle(face[1], face[2]), middle(face[2], face[0])};
    for (std::size_t k = 0; k < 3; ++k) {
      result.faces.push_back({face[k], centre[k], centre[(k + 2) % 3]});
    }
    result.faces.push_back({centre[0], centre[1], centre[2]});
  }
  return result;
}

/// The cube [0, edge]^3 of 12 triangles, refined once.
inline SurfaceMesh cube_mesh(double edge) {
  SurfaceMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.points.emplace_back(edge * (corner & 1), edge * (corner >> 1 & 1), edge * (corner >> 2));
  }
  for (const std::array<int, 4>& side :
       {std::array{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    mesh.faces.push_back({side[0], side[1], side[2]});
    mesh.faces.push_back({side[0], side[2], side[3]});
  }
  return refined(mesh);
}

inline Membrane membrane_of(const SurfaceMesh& mesh) { return make_membrane(PETSC_COMM_WORLD, mesh, SheetOptions()); }

inline Projectors free_to_move(const Membrane& membrane) {
  return Projectors(static_cast<std::size_t>(membrane.particles.local()));
}

inline Field rest_positions(const Membrane& membrane) {
  Field positions(membrane.particles, 3);
  positions.values() = membrane.rest;
  return positions;
}

/// A vector for each local vertex that looks random but depends on its persistent id alone, components in [-1, 1].
inline Field scattered(const Membrane& membrane, double phase) {
  Field field(membrane.particles, 3);
  for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
    const auto id = static_cast<double>(membrane.persistent_id[i]);
    field.vector(i) = Eigen::Array3d(12.9 * id + phase, 78.2 * id + 2 * phase, 37.7 * id + 3 * phase).sin();
  }
  return field;
}

inline Eigen::Vector3d sum_over_world(Eigen::Vector3d value) {
  MPI_Allreduce(MPI_IN_PLACE, value.data(), 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  return value;
}

/// Sum over the owned vertices of all ranks of a.b; (3 x owned or more) each.
template <class A, class B>
double dot(const Membrane& membrane, const A& a, const B& b) {
  const auto owned = static_cast<Eigen::Index>(membrane.particles.owned);
  return sum_over_ranks(PETSC_COMM_WORLD, a.leftCols(owned).cwiseProduct(b.leftCols(owned)).sum());
}

/// K w of the owned vertices with K = factor g g^T + load stiffness of pressure p, g the volume's gradient.
inline Eigen::Matrix3Xd gas_stiffness_product(const Membrane& membrane, const Chambers& chambers, const Field& x,
                                              double factor, double pressure, const Field& w) {
  const Eigen::Matrix3Xd gradient = chambers.volume_gradient(0, x);
  Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, membrane.particles.local());
  for (const auto& triangle : membrane.triangles) {
    add_pressure_stiffness_action(pressure, triangle, x.values(), w.values(), result);
  }
  return result.leftCols(gradient.cols()) + factor * dot(membrane, gradient, w.values()) * gradient;
}

}  // namespace pellicle
