#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "contact/contact_surface.h"
#include "parallel/field.h"

namespace pellicle {
inline namespace contact {

/// The drawn triangles that may touch what this rank owns of a surface: its own, and those of other ranks that are near
/// by place and not by the mesh.
///
/// The corners of triangles are points: first the particles of `reach()`, then the centres of quads, each of which
/// stands at the mean of four particles.
class ContactMesh {
 public:
  /// The surface must outlive it. Without triangles. Collective.
  explicit ContactMesh(const ContactSurface& surface);

  /// Finds the triangles, of which those are near whose boxes, wider by the margins of their corners, meet. Collective.
  /// @param x places of the particles, ghosts up to date
  /// @param margins of the local particles, ghosts up to date [m]
  /// @param start places of the particles at the beginning of the step, likewise
  /// @param further global numbers of particles that are to be in reach in any case
  void gather(const Field& x, const Field& start, const std::vector<double>& margins,
              const std::vector<PetscInt>& further);

  /// The surface's particles, and as further ghosts those of other ranks' triangles.
  const Layout& reach() const { return reach_; }
  bool reaches_further() const { return reaches_further_; }
  /// Number in `reach()` of a particle by its global one, or -1.
  PetscInt find(PetscInt global) const { return numbers_.find(global); }
  const std::vector<std::array<PetscInt, 3>>& triangles() const { return triangles_; }
  /// Of the triangles, wider by the margins, as they were gathered.
  const std::vector<Eigen::AlignedBox3d>& boxes() const { return boxes_; }
  PetscInt points() const { return reach_.local() + static_cast<PetscInt>(centres_.size()); }

  /// Particles of a point, all with the same weight, by their numbers in `reach()`.
  struct Particles {
    std::array<PetscInt, 4> number{};
    int count = 0;
    double weight() const { return 1.0 / count; }
    const PetscInt* begin() const { return number.data(); }
    const PetscInt* end() const { return number.data() + count; }
  };
  Particles particles(PetscInt point) const {
    return point < reach_.local() ? Particles{{point}, 1}
                                  : Particles{centres_[static_cast<std::size_t>(point - reach_.local())], 4};
  }
  /// Whether this rank owns a particle of a point.
  bool is_own(PetscInt point) const;

  /// Places of all points when the particles are at x, which need have no ghosts up to date. Collective.
  void write_points(const Field& x, Eigen::Matrix3Xd& points) const;
  /// The same of undeformed places. Not collective.
  Eigen::Vector3d rest(PetscInt point) const { return mean(known_.values().topRows<3>(), point); }
  /// Likewise at the beginning of the step.
  Eigen::Vector3d start(PetscInt point) const { return mean(known_.values().bottomRows<3>(), point); }
  /// Undeformed area round a point [m^2].
  double area(PetscInt point) const { return areas_[static_cast<std::size_t>(point)]; }
  /// As they were gathered: the largest of its particles [m].
  double margin(PetscInt point) const;
  /// Of the contact of the part that it is on with itself [m].
  double thickness(PetscInt point) const { return known_.values()(5, *particles(point).begin()); }

 private:
  struct Element;
  template <class Values>
  Eigen::Vector3d mean(const Values& values, PetscInt point) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const Particles of_point = particles(point);
    for (const PetscInt i : of_point) {
      sum += values.col(i);
    }
    return of_point.weight() * sum;
  }
  Element element(PetscInt number) const;
  Eigen::AlignedBox3d box(PetscInt element, const Field& x, const std::vector<double>& margins) const;
  bool touches_own(PetscInt element) const;
  std::vector<Element> receive(const std::vector<Element>& own, const std::vector<Eigen::AlignedBox3d>& boxes) const;
  void add(const Element& element, const std::array<PetscInt, 4>& corners);

  const ContactSurface& surface_;
  std::vector<double> particle_area_;  ///< round the local particles, without the parts of centres [m^2]

  Layout reach_;
  LocalNumbers numbers_;          ///< in `reach_`
  bool reaches_further_ = false;  ///< than the surface's layout, on any rank
  Field known_;                   ///< on `reach_`: undeformed place, area, margin, thickness, place at the start
  mutable Field places_;          ///< on `reach_`
  std::vector<std::array<PetscInt, 3>> triangles_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<std::array<PetscInt, 4>> centres_;  ///< particles
  std::vector<double> areas_;                     ///< of the points
};

}  // namespace contact
}  // namespace pellicle
