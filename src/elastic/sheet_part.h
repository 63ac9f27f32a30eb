#pragma once

#include <array>
#include <vector>

#include "elastic/mass_part.h"
#include "surface/active_set.h"
#include "surface/sheet.h"

namespace pellicle::elastic {

/// The data of a step of a SheetPart, besides the positions x~ of the sheet without forces.
struct SheetInput : MassInput {
  const std::array<std::vector<double>, 4>& target_length;  ///< of the local springs of each colour [m]
  const std::vector<double>& shrinkage;                     ///< length over undeformed length of each local particle
  const std::vector<double>& stiffness_factor;              ///< of each local particle, such as of char
  const ActiveSet& active;                                  ///< active triangles and springs, ghosts up to date
  /// y_v and 1/c of TimeIntegrator: velocities are (x - y_v)/damping_h; of implicit Euler those of the whole step.
  const Field& y_v = start;
  double damping_h = h;
};

/// StepPart of a sheet with mass that resists changes of its shape, and is viscous: its energies are potentials beside
/// inertia. The lattice points of a sheet of one layer follow their corners.
class SheetPart : public MassPart {
 public:
  /// Sets shape and stiffness of a step. Not collective.
  virtual void set_shape(const SheetInput& input) = 0;
  /// Begins a step. Collective. @param positions x~ [m], pinned particles in their places; ghosts up to date
  void begin(const Field& positions, const SheetInput& input);
  bool move_to(const Field& position, const Eigen::VectorXd& own) override;
  bool suits_patches() const override { return suits_patches_; }
  double rounding() const override;

  /// Stiffness with which statics holds each particle at the step's start, so that rigid motions are determined: a
  /// millionth of the undeformed tangent's diagonal [N/m].
  double holding_stiffness() const { return 1e-6 * rest_stiffness_; }
  /// Elastic energy with the shape and stiffness of the last step, without viscosity [J]. Collective.
  double elastic_energy(const Field& positions) const;
  /// The potentials that resist changes of shape, viscosity included.
  virtual std::vector<const Potential*> of_shape() const = 0;
  /// Work of viscosity in the last step, at most 0 [J]. Collective. @param positions at its end
  double viscous_work(const Field& positions) const;

 protected:
  /// The sheet must outlive this object. Collective. @param damping viscosity over stiffness [s]
  /// @param tolerance StepPart::tolerance @param pinned local particles that never move
  /// @param usual_h usual length of a step [s] @param others further potentials of the particles' positions; must
  /// outlive this object
  SheetPart(const Sheet& sheet, double damping, double tolerance, const std::vector<bool>& pinned, double usual_h,
            const std::vector<Potential*>& others)
      : MassPart(sheet, pinned, tolerance, usual_h, others), sheet_(sheet), damping_(damping) {
    followed_ = Field(sheet.particles, 3);
    for (std::size_t i = 0; sheet.layers == 1 && i < pinned.size(); ++i) {
      if (sheet.is_lattice[i] && !pinned[i]) {
        projectors_.bind(i, Eigen::Matrix3d::Zero());
      }
    }
  }
  /// Finds the scales of stiffness; to be called after all potentials have been made. Collective.
  void set_scales();
  /// This rank's fractions of elastic and viscous energy [J].
  virtual double own_elastic_energy(const Field& positions) const = 0;
  virtual double own_viscous_energy(const Field& positions) const = 0;

  const Sheet& sheet_;
  double damping_;
  double negligible_force_ = 0;  ///< norm of a negligible residual [N]

 private:
  double rest_stiffness_ = 0;  ///< root of the mean square of the undeformed tangent's diagonal [N/m]
  Field followed_;             ///< positions with those of lattice points that follow
  bool suits_patches_ = false;
};

}  // namespace pellicle::elastic
