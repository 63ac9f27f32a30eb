#pragma once

#include <array>
#include <vector>

#include "elastic/elastic_options.h"
#include "elastic/mass_part.h"
#include "elastic/spring_potential.h"
#include "surface/living.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace elastic {

/// The data of a step of a SpringSheet, besides the positions x~ to which the sheet would go without springs.
struct SheetInput : MassInput {
  const std::array<std::vector<double>, 4>& target_length;  ///< of the local springs of each colour [m]
  const std::vector<double>& shrinkage;                     ///< length over undeformed length of each local particle
  const std::vector<double>& stiffness_factor;              ///< of each local particle, such as of char
  const Living& living;                                     ///< what has not burnt, ghosts up to date
};

/// The part of an implicit Euler step of a sheet of Hooke springs with dashpots beside them: from the unconstrained
/// positions x~ (burning paper, eq. 9) the step ends at
///
///     x = argmin sum_i m_i |x_i - x~_i|^2 / (2 h^2) + sum_s k_s (d_s - l_s)^2 / 2 + c_s (d_s - d_s(start))^2 / (2 h),
///
/// with the length d of a spring, its target length l and its dashpot c.
///
/// By itself it is the mass-spring sheet with which successive fast projection is compared (burning paper, section 8,
/// Fig. 7 b, d): living springs of every colour are equally stiff.
class SpringSheet : public MassPart {
 public:
  /// The sheet must outlive it. Collective.
  /// @param pinned local particles that are never to move @param usual_h length of most steps [s]
  /// @param others what else acts on the particles' positions; must outlive it
  SpringSheet(const Sheet& sheet, const SpringOptions& options, const std::vector<bool>& pinned, double usual_h,
              const std::vector<Potential*>& others);

  /// Sets lengths and stiffness as a step has them. Not collective.
  virtual void set_shape(const SheetInput& input);
  /// Begins a step. Collective. @param positions x~ [m], pinned particles in their places; ghosts up to date
  void begin(const Field& positions, const SheetInput& input);
  void begin_tangent(Curvature /*curvature*/, double positive_share) override {
    springs_.set_positive_share(positive_share);
  }
  bool suits_patches() const override { return suits_patches_; }
  double rounding() const override;

  /// Stiffness with which a step of statics holds each particle at its start, so that rigid motions have one: a
  /// millionth of the undeformed tangent's diagonal [N/m].
  double holding_stiffness() const { return 1e-6 * rest_stiffness_; }
  /// Largest ratio of the stiffness along a side of a cell to that asked for, of all ranks. Collective.
  virtual double largest_excess() const { return 1; }
  /// Whether the owned springs of each colour have stiffness. Not collective.
  std::array<std::vector<bool>, 4> bearing_springs(const Living& living);
  /// Forces of the owned springs by colour at some positions, with the lengths and stiffness of the last step, positive
  /// where they pull [N]. Not collective.
  std::array<std::vector<double>, 4> spring_forces(const Field& positions) const { return springs_.forces(positions); }
  /// Energy of what resists changes of shape, with the lengths and stiffness of the last step and without viscosity.
  /// Collective. [J]
  double elastic_energy(const Field& positions) const;
  /// The potentials that resist changes of the shape of the sheet, viscosity included.
  virtual std::vector<const Potential*> of_shape() const { return {&springs_}; }
  /// Work of viscosity in the last step, which has led to these positions, at most 0. Collective. [J]
  double viscous_work(const Field& positions) const;

 protected:
  /// @param damping viscosity over stiffness [s] @param tolerance see StepPart::tolerance
  SpringSheet(const Sheet& sheet, double damping, double tolerance, const std::vector<bool>& pinned, double usual_h,
              const std::vector<Potential*>& others);
  /// To be called when all potentials are there: finds the scales of stiffness. Collective.
  void set_scales();
  /// Of the local springs by colour, 0 of those that do not act [N/m].
  virtual const std::array<std::vector<double>, 4>& stiffness(const Living& living);
  /// This rank's shares of the energies of what resists changes of shape [J].
  virtual double own_elastic_energy(const Field& positions) const { return springs_.elastic_energy(positions); }
  virtual double own_viscous_energy(const Field& positions) const { return springs_.viscous_energy(positions); }

  const Sheet& sheet_;
  double damping_;
  SpringPotential springs_;

 private:
  double equal_stiffness_ = 0;  ///< of every living spring, unless a derived class has others [N/m]
  std::array<std::vector<double>, 4> equal_stiffnesses_;
  double negligible_force_ = 0;  ///< norm of a residual that needs no answer [N]
  double rest_stiffness_ = 0;    ///< root of the mean square of the undeformed tangent's diagonal [N/m]
  bool suits_patches_ = false;
};

}  // namespace elastic
}  // namespace pellicle
