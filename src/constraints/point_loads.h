#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "constraints/pins.h"
#include "energies/vertex_potential.h"
#include "options/options.h"
#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle::constraints {

/// Vertices tied to moving places by springs of zero length: one of the named objects `attachments`, a soft pin.
struct AttachmentOptions : PinOptions {
  double total_stiffness = 1e3;  ///< of all springs; each has its vertex's fraction of the area [N/m]
};

void describe(OptionTable& table, AttachmentOptions& options);

/// A force on a region: one of the named objects `forces`.
struct PushOptions : SelectionOptions {
  Rows force;  ///< time [s], x, y, z [N] in total; each vertex gets its fraction of the area
};

void describe(OptionTable& table, PushOptions& options);

/// Loads that act on single vertices, each with a potential:
///
/// - attachments, k/2 |x - X - u(t)|^2 with undeformed place X;
/// - forces, -f(t).(x - X).
class PointLoads {
 public:
  /// Collective. The points must outlive the loads.
  /// @param areas undeformed area round each local particle [m^2]
  /// @param chosen result of `chosen` of earlier loads with the same options; null: selects the particles
  /// @throws Error that names the object and the key, the same on all ranks
  PointLoads(const Surface& points, const std::vector<double>& areas,
             const std::map<std::string, AttachmentOptions>& attachments,
             const std::map<std::string, PushOptions>& forces, const std::vector<bool>* chosen = nullptr);

  /// Whether each attachment, then each force, acts on a local particle; particle after particle.
  const std::vector<bool>& chosen() const { return chosen_; }

  /// Sets the time [s]. To be called before `at`. Not collective.
  void set_time(double time);

  /// Potential of a local particle at position x [m]. Not collective.
  PointPotential at(PetscInt particle, const Eigen::Vector3d& x) const;

  bool empty() const { return attachments_.empty() && pushes_.empty(); }

 private:
  struct Attachment {
    AttachmentOptions options;
    std::vector<double> stiffness;  ///< of each local particle; 0: not tied [N/m]
    Eigen::Vector3d displacement;   ///< at the end of the step [m]
  };
  struct Push {
    Rows path;
    std::vector<double> fraction;  ///< of each local particle
    Eigen::Vector3d force;         ///< in total, at the end of the step [N]
  };

  const Surface* points_;
  std::vector<bool> chosen_;
  std::vector<Attachment> attachments_;
  std::vector<Push> pushes_;
};

}  // namespace pellicle::constraints
