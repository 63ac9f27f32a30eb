#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "contact/contact_mesh.h"
#include "meshing/triangulation.h"
#include "parallel/collective.h"
#include "surface/membrane.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {

/// A long sheet of quads, and a membrane of triangles over it, which the ranks share in different ways; all that is
/// known of both on every rank. Particles and elements of all ranks have numbers: those of the sheet by their ids, then
/// those of the membrane.
class FacingSurfaces {
 public:
  static constexpr double edge = 0.05;  // [m]
  static constexpr std::array<double, 2> thickness{0.01, 0.014};
  static constexpr std::array<double, 2> stiffness{4e6, 3e6};

  /// A drawn element.
  struct Element {
    std::size_t part;
    std::vector<PetscInt> corners;  ///< numbers of its particles
    std::vector<bool> lives;        ///< its surface triangles
    double area;                    ///< [m^2]
  };

  /// @param lift of the undeformed membrane over the sheet [m] @param gap between both where they are near [m]
  FacingSurfaces(double lift, double gap)
      : gap(gap),
        sheet(make_sheet(PETSC_COMM_WORLD, lower(), SheetOptions())),
        membrane(make_membrane(PETSC_COMM_WORLD, upper(lift), SheetOptions())),
        surface({{&sheet, thickness[0], stiffness[0]}, {&membrane, thickness[1], stiffness[1]}}),
        x(surface.particles(), 3),
        start(surface.particles(), 3),
        low(surface.particles(), 3),
        high(surface.particles(), 3) {
    rest.setZero(3, sheet.id_end);
    for (std::size_t part = 0; part < 2; ++part) {
      const SurfaceMesh mesh = part == 0 ? lower() : upper(lift);
      const PetscInt first = part == 0 ? 0 : sheet.id_end;
      rest.conservativeResize(3, first + of_part(part).id_end);
      for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        rest.col(first + static_cast<Eigen::Index>(i)) = mesh.points[i];
      }
      for (const std::vector<int>& face : mesh.faces) {
        Element element{part, {}, std::vector<bool>(face.size() == 4 ? 4 : 1, true), 0};
        for (const int corner : face) {
          element.corners.push_back(first + corner);
        }
        const auto side = [&](std::size_t from, std::size_t to) -> Eigen::Vector3d {
          return mesh.points[face[to]] - mesh.points[face[from]];
        };
        element.area = (face.size() == 4 ? side(0, 2).cross(side(1, 3)) : side(0, 1).cross(side(0, 2))).norm() / 2;
        elements.push_back(element);
      }
    }
    const std::vector<PetscInt> here = numbers();
    for (PetscInt i = 0; i < surface.particles().local(); ++i) {
      const PetscInt number = here[i];
      x.vector(i) = place(number);
      start.vector(i) = start_place(number);
      low.vector(i) = least(number);
      high.vector(i) = greatest(number);
    }
    owner.assign(static_cast<std::size_t>(rest.cols()), 0);
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    for (PetscInt i = 0; i < surface.particles().owned; ++i) {
      owner[here[i]] = rank;
    }
    sum_over_ranks(PETSC_COMM_WORLD, owner);
  }
  FacingSurfaces(const FacingSurfaces&) = delete;  // The contact surface points to both.
  FacingSurfaces& operator=(const FacingSurfaces&) = delete;

  std::size_t part_of(PetscInt number) const { return number < sheet.id_end ? 0 : 1; }
  PetscInt all_particles() const { return rest.cols(); }

  // Where particles are, and how far they may go. Not at rest: the membrane is near the sheet.
  Eigen::Vector3d place(PetscInt number) const {
    Eigen::Vector3d place = rest.col(number);
    place.z() = (part_of(number) == 0 ? 0 : gap) + 0.004 * std::sin(31 * place.x() + 17 * place.y());
    return place;
  }
  Eigen::Vector3d start_place(PetscInt number) const { return place(number) + 0.001 * some_vector(number, 1); }
  Eigen::Vector3d least(PetscInt number) const { return -0.002 * some_vector(number, 2).cwiseAbs(); }
  Eigen::Vector3d greatest(PetscInt number) const { return 0.001 * some_vector(number, 3).cwiseAbs(); }
  /// Components between -1 and 1.
  static Eigen::Vector3d some_vector(PetscInt number, int which) {
    const double at = static_cast<double>(number) + 0.37 * which;
    return {std::sin(7 * at), std::cos(11 * at), std::sin(5 * at + 1)};
  }

  /// Numbers of the local particles of the surface.
  std::vector<PetscInt> numbers() const {
    std::vector<PetscInt> result(static_cast<std::size_t>(surface.particles().local()));
    for (std::size_t part = 0; part < 2; ++part) {
      for (PetscInt i = 0; i < of_part(part).particles.local(); ++i) {
        result[surface.joined().local(part, i)] = (part == 0 ? 0 : sheet.id_end) + of_part(part).persistent_id[i];
      }
    }
    return result;
  }
  /// Numbers of the particles in the reach of a mesh. Collective.
  std::vector<PetscInt> numbers_in(const ContactMesh& mesh) const {
    std::vector<PetscInt> result = numbers();
    result.resize(static_cast<std::size_t>(mesh.reach().local()));
    update_ghosts(mesh.reach(), result);
    return result;
  }
  /// Of a point of a mesh: the rising numbers of its particles, one or four. @param numbers of the particles in reach
  static std::vector<PetscInt> name_of(const ContactMesh& mesh, const std::vector<PetscInt>& numbers, PetscInt point) {
    std::vector<PetscInt> name;
    for (const PetscInt i : mesh.particles(point)) {
      name.push_back(numbers[i]);
    }
    std::sort(name.begin(), name.end());
    return name;
  }

  /// Takes surface triangles away, by the elements' flags. To be called before triangles are gathered.
  void let_die() {
    for (std::size_t part = 0; part < 2; ++part) {
      std::vector<bool> active;
      for (const PetscInt id : of_part(part).element_id) {
        const std::vector<bool>& lives = elements[id + (part == 0 ? 0 : first_of_membrane())].lives;
        active.insert(active.end(), lives.begin(), lives.end());
      }
      surface.set_active(part, active);
    }
  }
  /// First element of the membrane.
  PetscInt first_of_membrane() const { return sheet.elements.global; }

  ContactMesh::Motion motion(const std::vector<bool>& is_new) const { return {x, low, high, is_new}; }
  /// For a first search.
  std::vector<bool> all_new() const {
    return std::vector<bool>(static_cast<std::size_t>(surface.particles().local()), true);
  }

  double gap;
  Sheet sheet;
  Membrane membrane;
  ContactSurface surface;
  Field x;
  Field start;
  Field low;
  Field high;
  Eigen::Matrix3Xd rest;          ///< of the particles of all ranks; zeros of lattice particles
  std::vector<int> owner;         ///< of the same, its rank
  std::vector<Element> elements;  ///< of all ranks

 private:
  const Surface& of_part(std::size_t part) const { return part == 0 ? static_cast<const Surface&>(sheet) : membrane; }
  static SurfaceMesh lower() {
    SurfaceMesh mesh = grid_mesh(16, 2, edge);
    for (Eigen::Vector3d& point : mesh.points) {
      point += 0.1 * edge * Eigen::Vector3d(std::sin(100 * point.x() + 37 * point.y()), std::cos(53 * point.x()), 0);
    }
    return mesh;
  }
  static SurfaceMesh upper(double lift) {
    SurfaceMesh mesh = triangulated(grid_mesh(13, 2, edge));
    const Eigen::AngleAxisd turn(0.05, Eigen::Vector3d::UnitZ());
    for (Eigen::Vector3d& point : mesh.points) {
      point = turn * point + Eigen::Vector3d(0.021, 0.013, lift);
    }
    return mesh;
  }
};

}  // namespace pellicle
