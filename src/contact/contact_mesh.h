#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "contact/contact_surface.h"
#include "geometry/box_tree.h"
#include "parallel/field.h"

namespace pellicle::contact {

/// The surface triangles that may touch this rank's part of a surface: its own, and those of other ranks that are near
/// in space.
///
/// The corners of triangles are points: first the particles of `reach()`, then the centres of quads, each of which
/// stands at the mean of four particles.
class ContactMesh {
 public:
  /// The surface must outlive this object, which has no triangles until `gather`. Collective.
  explicit ContactMesh(const ContactSurface& surface);

  /// Places of the particles and the bounds of their displacements, component by component; ghosts up to date.
  struct Motion {
    const Field& x;
    const Field& low;
    const Field& high;
    const std::vector<bool>& is_new;  ///< for each local particle: whether it may now go beyond the last call's bounds
  };

  /// Gathers the triangles that are near: those whose boxes meet. The box of a triangle holds all places to which its
  /// corners may move, and is wider by half of the thickness. Collective.
  /// @param start places of the particles at the beginning of the step, ghosts up to date
  /// @param further global numbers of particles that are to be in reach in any case
  /// @returns whether triangles and points are numbered as they were before; if not, all are new
  bool gather(const Motion& motion, const Field& start, const std::vector<PetscInt>& further);

  /// The surface's particles, and as further ghosts those of other ranks' triangles.
  const Layout& reach() const { return reach_; }
  /// Number in `reach()` of a particle by its global one, or -1.
  PetscInt find(PetscInt global) const { return numbers_.find(global); }
  const std::vector<std::array<PetscInt, 3>>& triangles() const { return triangles_; }
  /// Points and sides that a triangle represents: one triangle represents each point and side of the mesh.
  struct Leads {
    std::array<bool, 3> point{};
    std::array<bool, 3> side{};  ///< from each point to the next
  };
  const std::vector<Leads>& leads() const { return leads_; }
  /// The boxes of the triangles, as they were gathered.
  const std::vector<Bounds>& boxes() const { return boxes_; }
  /// The tree of these boxes.
  const BoxTree& tree() const { return tree_; }
  PetscInt points() const { return reach_.local() + static_cast<PetscInt>(centres_.size()); }

  /// Particles whose mean a point is, by their numbers in `reach()`.
  struct Particles {
    std::array<PetscInt, 4> number{};
    int count = 0;
    double weight() const { return 1.0 / count; }
    const PetscInt* begin() const { return number.data(); }
    const PetscInt* end() const { return number.data() + count; }
  };
  Particles particles(PetscInt point) const {
    return point < reach_.local() ? Particles{{point}, 1} : Particles{centres_[point - reach_.local()], 4};
  }
  /// Whether any triangle has a particle as a corner or in its centre. @param particle number in `reach()`
  bool has(PetscInt particle) const { return has_[particle]; }

  /// Places of all points when the particles are at x, whose ghosts need not be up to date. Collective.
  void write_points(const Field& x, Eigen::Matrix3Xd& points) const;

  /// Data of a point, from the last `gather`.
  struct Point {
    Eigen::Vector3d rest;   ///< undeformed place [m]
    Eigen::Vector3d start;  ///< at the beginning of the step
    Eigen::Vector3d low;    ///< lower bound of the point's displacement [m]
    Eigen::Vector3d high;   ///< upper bound of the displacement [m]
    Bounds box;             ///< of the places to which the point may move, wider by half of the thickness
    double area = 0;        ///< undeformed, round the point [m^2]
    double thickness = 0;   ///< of the contact of the point's part with itself [m]
    double stiffness = 0;   ///< of that contact [Pa/m]
    bool is_own = false;    ///< whether this rank owns a particle of the point
    bool is_new = false;    ///< whether the point may now go beyond the last call's bounds
  };
  const Point& point(PetscInt number) const { return points_[number]; }

 private:
  /// An element as it is sent to other ranks: its corners are global numbers.
  struct Element : ContactSurface::Element {
    PetscInt number = 0;  ///< global
  };
  template <class Values>
  Eigen::Vector3d mean(const Values& values, PetscInt point) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const Particles of_point = particles(point);
    for (const PetscInt i : of_point) {
      sum += values.col(i);
    }
    return of_point.weight() * sum;
  }
  Eigen::AlignedBox3d box(PetscInt element, const Motion& motion) const;
  std::vector<Element> receive(const std::vector<Element>& here, std::size_t own,
                               const std::vector<Eigen::AlignedBox3d>& boxes, double margin) const;
  void add(const Element& element);
  void find_leads();
  void find_points(const Field& known);

  const ContactSurface& surface_;
  std::vector<double> particle_area_;  ///< round the local particles, without the parts of centres [m^2]

  Layout reach_;
  std::vector<Element> received_;  ///< from other ranks, since a search in which all was new
  LocalNumbers numbers_;           ///< in `reach_`
  bool reaches_further_ = false;   ///< than the surface's layout, on any rank
  mutable Field places_;           ///< on `reach_`
  std::vector<std::array<PetscInt, 3>> triangles_;
  std::vector<Leads> leads_;  ///< of the triangles
  std::vector<Bounds> boxes_;
  BoxTree tree_;
  std::vector<std::array<PetscInt, 4>> centres_;  ///< particles
  std::vector<double> centre_area_;               ///< of the quads [m^2]
  std::vector<Point> points_;
  std::vector<bool> has_;  ///< of the particles in reach
};

}  // namespace pellicle::contact
