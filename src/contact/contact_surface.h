#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "options/options.h"
#include "parallel/joined_layout.h"
#include "surface/surface.h"

namespace pellicle::contact {

/// How a run treats surfaces that pass through themselves or each other at its start.
enum class ContactStart { accept, untangle, refuse };
inline std::vector<std::string> names_of(ContactStart) { return {"accept", "untangle", "refuse"}; }

/// Options of contact of surfaces with bodies, each other and themselves.
struct ContactOptions {
  bool self = false;                ///< whether drawn surfaces keep apart from each other and from themselves
  std::optional<double> thickness;  ///< gap below which surfaces press [m]; none: a fraction of the mean side
  std::optional<double> stiffness;  ///< pressure over depth [Pa/m]; none: usual_contact_stiffness
  double friction = 0;              ///< Coulomb's coefficient between surfaces
  Choice<ContactStart> start = ContactStart::accept;
  bool check = false;        ///< count after every step where surfaces pass through themselves
  double slip_speed = 1e-3;  ///< relative speed above which friction is Coulomb's in full [m/s]
};

/// @param bodies if contact.stiffness acts on bodies @param body_friction if a body has friction
void describe(OptionTable& table, ContactOptions& options, const Condition& bodies, const Condition& body_friction);

/// The drawn surfaces that touch each other, of one object or of several, as one: their particles are numbered in one
/// sequence as by JoinedLayout, and so are their elements.
class ContactSurface {
 public:
  /// A surface that touches itself and the other parts.
  struct Part {
    const Surface* surface;
    std::optional<double> thickness;  ///< ContactOptions::thickness [m]
    double stiffness = 0;             ///< of the part's contact with itself [Pa/m]
    /// Thickness of the part's contact, a fifth of the mean side by default [m]. Collective.
    double thickness_or_usual() const;
  };
  /// An element: a triangle, or a quad that is drawn as four triangles.
  struct Element {
    std::array<PetscInt, 4> corners{-1, -1, -1, -1};  ///< particles; a triangle's fourth is -1
    PetscInt lattice = -1;                            ///< particle at a quad's centre, owned with the quad; -1: none
    std::array<bool, 4> lives{};                      ///< of its surface triangles: whether they are active
    double area = 0;                                  ///< undeformed [m^2]
    bool is_quad() const { return corners[3] >= 0; }
  };

  /// Collective. @param parts at least one, of the same communicator; must outlive it
  explicit ContactSurface(const std::vector<Part>& parts);

  MPI_Comm comm() const { return particles_.layout().comm; }
  const JoinedLayout& joined() const { return particles_; }
  const Layout& particles() const { return particles_.layout(); }
  const Layout& elements() const { return elements_.layout(); }
  /// A local element.
  const Element& element(PetscInt number) const { return local_elements_[number]; }
  /// Undeformed places of the local particles [m].
  const Eigen::Matrix3Xd& rest() const { return rest_; }
  /// Thickness of the contact with itself of the part that a local particle is in [m].
  double thickness(PetscInt particle) const { return *parts_[part_[particle]].thickness; }
  /// Stiffness of that contact [Pa/m].
  double stiffness(PetscInt particle) const { return parts_[part_[particle]].stiffness; }
  /// The largest thickness of all parts [m].
  double largest_thickness() const { return largest_thickness_; }

  /// Sets the stiffness of a part's contact with itself [Pa/m].
  void set_stiffness(std::size_t part, double stiffness) { parts_[part].stiffness = stiffness; }
  /// Sets which surface triangles of a part are active; all at first.
  void set_active(std::size_t part, const std::vector<bool>& triangles);

 private:
  std::vector<Part> parts_;  ///< with their thickness
  JoinedLayout particles_;
  JoinedLayout elements_;
  std::vector<Element> local_elements_;
  Eigen::Matrix3Xd rest_;
  std::vector<std::size_t> part_;  ///< of each local particle
  double largest_thickness_ = 0;
};

/// Mean undeformed side of a surface's elements [m]. Collective.
double mean_side(const Surface& surface);

/// Gap below which bodies press on a surface: as given, or else a tenth of the mean side of the mesh [m]. Collective.
double contact_thickness(const Surface& surface, const ContactOptions& options);

/// Usual contact stiffness of a surface, 20 T/s^2 + 4 m/h^2 [Pa/m]: half a gap of s/10 bears a tension T that is bent
/// round a side s, and an area that comes into contact is stopped within a step. Collective.
/// @param tension T, the largest [N/m] @param areal_mass m, 0 without inertia [kg/m^2] @param h of most steps [s]
double usual_contact_stiffness(const Surface& surface, double tension, double areal_mass, double h);

}  // namespace pellicle::contact
