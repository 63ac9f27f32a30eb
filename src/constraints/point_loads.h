#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "base/options.h"
#include "constraints/pins.h"
#include "contact/bodies.h"
#include "contact/contact_options.h"
#include "contact/slip.h"
#include "parallel/field.h"
#include "solvers/vertex_potential.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace constraints {

/// Vertices tied to moving places by springs of no length: one of the named objects `attachments`, a soft pin.
struct AttachmentOptions : PinOptions {
  double total_stiffness = 1e3;  ///< of all its springs; each has its vertex's share of the area [N/m]
};

void describe(OptionTable& table, AttachmentOptions& options);

/// A force on a region: one of the named objects `forces`.
struct PushOptions : SelectionOptions {
  Rows force;  ///< time [s], x, y, z [N] in total; each vertex gets its share of the area
};

void describe(OptionTable& table, PushOptions& options);

/// Loads that act on single vertices, each with a potential:
///
/// - attachments, k/2 |x - X - u(t)|^2 with undeformed place X;
/// - forces, -f(t).(x - X);
/// - bodies, A c/2 d^2 with the area A round the vertex, contact stiffness c and the depth d below the margin. Of the
///   Hessian the curvature of a sphere is left out, which is negative;
/// - friction on bodies, mu N s(|u|), with the slip u along the surface relative to the body over the step. As in
///   incremental potential contact (Li et al. 2020, section 5), normal force N and surface are those of the step's
///   start, and s is smooth (SmoothSlip) up to e = h slip_speed. A vertex that friction could hold creeps at less than
///   slip_speed.
class PointLoads {
 public:
  /// Collective. The points must outlive the loads.
  /// @param areas undeformed area round each local particle [m^2]
  /// @param chosen see `chosen`, of loads with these options that were made before; null: to be found
  /// @throws Error that names the object and the key, the same on all ranks
  PointLoads(const Surface& points, std::vector<double> areas,
             const std::map<std::string, AttachmentOptions>& attachments,
             const std::map<std::string, PushOptions>& forces, const std::map<std::string, BodyOptions>& bodies,
             const ContactOptions& contact, const std::vector<bool>* chosen = nullptr);

  /// Whether each attachment, then each force, acts on a local particle: particle after particle.
  const std::vector<bool>& chosen() const { return chosen_; }

  /// Fixes time and what is lagged (normal forces, tangents of friction) for the step that ends at `time_end` [s]. To
  /// be called before `at`. Not collective.
  /// @param start positions at the beginning of the step [m], ghosts up to date
  void begin_step(const Field& start, double time_end, double h);

  /// Of a local particle at position x [m]. Not collective.
  PointPotential at(PetscInt particle, const Eigen::Vector3d& x) const;

  bool empty() const { return attachments_.empty() && pushes_.empty() && contacts_.empty(); }

 private:
  struct Attachment {
    Eigen::Vector3d velocity;  ///< [m/s]
    Rows path;
    std::vector<double> stiffness;  ///< of each local particle, 0 where it is not tied [N/m]
    Eigen::Vector3d displacement;   ///< at the end of the step [m]
  };
  struct Push {
    Rows path;
    std::vector<double> share;  ///< of each local particle
    Eigen::Vector3d force;      ///< in total, at the end of the step [N]
  };
  /// Friction of a particle on a body, as at the start of the step.
  struct Friction {
    double force = 0;  ///< mu N [N]
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  };
  struct Contact {
    Body body;
    Solid solid;                     ///< at the end of the step
    Pose before;                     ///< of the body at the start of the step
    std::vector<Friction> friction;  ///< of each local particle
  };

  /// Share of each local particle in the area of those on which a load acts, 0 for the others; collective.
  std::vector<double> shares(std::size_t load) const;
  void add_pressure(PetscInt particle, const Eigen::Vector3d& x, const Contact& contact, PointPotential& sum) const;
  void add_friction(PetscInt particle, const Eigen::Vector3d& x, const Contact& contact, PointPotential& sum) const;

  const Surface* points_;
  std::vector<double> areas_;
  std::size_t loads_;  ///< attachments and forces
  std::vector<bool> chosen_;
  ContactOptions options_;
  std::vector<Attachment> attachments_;
  std::vector<Push> pushes_;
  std::vector<Contact> contacts_;
  Eigen::Matrix3Xd start_;  ///< positions at the start of the step [m]
  SmoothSlip slip_;         ///< of the step
};

}  // namespace constraints
}  // namespace pellicle
