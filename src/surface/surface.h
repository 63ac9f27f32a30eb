#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "parallel/layout.h"

namespace pellicle::surface {

/// The four sets of springs of the body-centred-square shell (burning paper, section 3.2), in the order of projection.
/// A colour is the place of its set in arrays.
enum Colour : std::size_t { red = 0, green = 1, blue = 2, yellow = 3 };
inline constexpr std::array<Colour, 4> all_colours{Colour::red, Colour::green, Colour::blue, Colour::yellow};
inline constexpr std::array<const char*, 4> colour_names{"red", "green", "blue", "yellow"};

/// The springs of one colour. Local numbers run over owned springs, then ghosts: springs of other ranks that end at a
/// particle of this rank, share a particle with an owned spring, or lie in a cell of this rank. Both ends of every
/// local spring are local particles.
struct SpringSet {
  Layout layout;
  std::vector<std::array<PetscInt, 2>> ends;  ///< local particle numbers
  std::vector<double> initial_length;         ///< l^init [m]
  /// Surface triangles that share each local spring: two of its cell for a red one, those at its edge for a blue one,
  /// those at the edge that it crosses for a green one, all four of its cell for a yellow one. -1: none, or for ghosts
  /// also one that is not local.
  std::vector<std::array<PetscInt, 4>> triangles;

  PetscInt owned() const { return layout.owned; }
  PetscInt local() const { return layout.local(); }
};

/// Quality of the distribution of a mesh over the ranks.
struct PartitionQuality {
  PetscInt edge_cut = 0;   ///< pairs of neighbouring cells on different ranks
  double imbalance = 1.0;  ///< largest number of cells of a rank over the mean
};

/// Common data of sheets of quads and membranes of triangles, distributed, as flat arrays: all that heating, burning
/// and cutting need. Elements are the quads or the triangles of the mesh.
///
/// An element is drawn as `triangles_per_element` triangles, 1 of a triangle and 4 of a quad: triangle 4 c + k of quad
/// c joins its corners k and k + 1 with its centre, the mean of its corners. The particle of the centre is the quad's
/// lattice point, which is drawn at the centre. Numbers of particles and elements are local ones; all particles of
/// local elements are local.
struct Surface {
  Layout particles;
  std::vector<PetscInt> persistent_id;  ///< of each local particle
  PetscInt id_end = 0;                  ///< above all persistent ids, also those of removed particles
  std::vector<bool> is_lattice;         ///< whether each local particle is a lattice point
  std::vector<int> cell_count;          ///< elements round each owned particle; 0 for a lattice point
  Eigen::Matrix3Xd rest;                ///< undeformed positions of the local particles [m], (3 x local)
  Eigen::Matrix2Xd uv;                  ///< texture coordinates of the local particles, (2 x local), or no columns
  std::map<std::string, std::vector<PetscInt>> groups;  ///< named sets of local particles (vertices of the mesh)
  PartitionQuality partition;

  Layout elements;
  std::vector<PetscInt> element_id;  ///< of each local element: its number in the file
  int triangles_per_element = 1;
  std::vector<std::array<PetscInt, 3>> triangles;  ///< particles of the surface triangles of the local elements
  std::vector<std::array<PetscInt, 4>> cells;      ///< corners of each local quad, in order
  std::vector<PetscInt> lattice;                   ///< lattice particle of each local quad

  /// Pieces of the mesh, joined by common sides of elements, numbered by their lowest element.
  std::vector<int> piece;             ///< of each local element
  std::vector<bool> piece_is_closed;  ///< of each piece: no boundary sides. The same on every rank.

  // Data for burning; for a membrane given by its wall (set_burnable).
  std::vector<double> initial_mass;  ///< m^init of the local particles [kg]
  std::vector<double> element_mass;  ///< of the local elements, divided among their particles [kg]
  /// Springs by Colour. A membrane's edges are blue springs without force, which conduct heat and connect pieces: those
  /// of its local elements, all treated as owned.
  std::array<SpringSet, 4> springs;

  MPI_Comm comm() const { return particles.comm; }
  int pieces() const { return static_cast<int>(piece_is_closed.size()); }
  bool has_quads() const { return triangles_per_element == 4; }
  /// Number of the surface triangles of the owned elements, which come first.
  PetscInt owned_triangles() const { return triangles_per_element * elements.owned; }
  std::size_t element_of_triangle(std::size_t triangle) const {
    return triangle / static_cast<std::size_t>(triangles_per_element);
  }
  /// Side `sides_per_element() e + k` of local element e joins its corners k and k + 1.
  int sides_per_element() const { return has_quads() ? 4 : 3; }
  std::size_t element_of_side(std::size_t side) const { return side / static_cast<std::size_t>(sides_per_element()); }
  /// The surface triangle at a side.
  std::size_t triangle_at(std::size_t side) const { return has_quads() ? side : element_of_side(side); }
  /// Corner k of a local element, in the mesh's order round it; k may go round once more.
  PetscInt corner(std::size_t element, std::size_t k) const {
    return has_quads() ? cells[element][k % 4] : triangles[element][k % 3];
  }
  /// The sides of local elements along a blue spring; -1: none.
  std::array<PetscInt, 2> sides_along(std::size_t blue) const {
    const SpringSet& edges = of(Colour::blue);
    std::array<PetscInt, 2> sides{edges.triangles[blue][0], edges.triangles[blue][1]};
    const auto is_end = [&](PetscInt particle) {
      return particle == edges.ends[blue][0] || particle == edges.ends[blue][1];
    };
    for (PetscInt& side : sides) {
      if (side >= 0 && !has_quads()) {
        const std::size_t element = side;
        side *= 3;
        for (std::size_t k = 0; !is_end(corner(element, k)) || !is_end(corner(element, k + 1)); ++k) {
          ++side;
        }
      }
    }
    return sides;
  }
  /// Shares of the points of a surface triangle in its mass and area.
  std::array<double, 3> point_shares() const {
    return has_quads() ? std::array{0.25, 0.25, 0.5} : std::array{1.0 / 3, 1.0 / 3, 1.0 / 3};
  }
  SpringSet& of(Colour colour) { return springs[colour]; }
  const SpringSet& of(Colour colour) const { return springs[colour]; }
};

/// Whether each local particle is in a named group of the mesh. Not collective.
/// @param key of the option that names the group, "pins.rail.group"
/// @throws Error that lists the mesh's groups, the same on every rank, if there is no such group
std::vector<bool> members_of_group(const Surface& points, const std::string& key, const std::string& group);

/// Planes of symmetry with a common point, and the particles of a surface in them.
struct SymmetryPlanes {
  std::vector<Eigen::Vector3d> normals;  ///< unit vectors, 32 at most
  /// For each local particle bit k is set if it lies in plane k; empty without planes.
  std::vector<unsigned> of_particle;

  /// Bits of the planes in which two particles both lie. Not collective.
  unsigned common(PetscInt a, PetscInt b) const { return of_particle.empty() ? 0 : of_particle[a] & of_particle[b]; }
};

}  // namespace pellicle::surface
