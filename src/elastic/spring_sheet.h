#pragma once

#include <array>
#include <optional>
#include <vector>

#include "elastic/bending_potential.h"
#include "elastic/elastic_options.h"
#include "elastic/mass_part.h"
#include "elastic/spring_potential.h"
#include "surface/active_set.h"
#include "surface/sheet.h"

namespace pellicle::elastic {

/// The data of a step of a SpringSheet, besides the positions x~ of the sheet without springs.
struct SheetInput : MassInput {
  const std::array<std::vector<double>, 4>& target_length;  ///< of the local springs of each colour [m]
  const std::vector<double>& shrinkage;                     ///< length over undeformed length of each local particle
  const std::vector<double>& stiffness_factor;              ///< of each local particle, such as of char
  const ActiveSet& active;                                  ///< active triangles and springs, ghosts up to date
  /// y_v and 1/c of TimeIntegrator: velocities are (x - y_v)/damping_h; of implicit Euler those of the whole step.
  const Field& y_v = start;
  double damping_h = h;
};

/// StepPart of a sheet of Hooke springs with parallel dashpots, by implicit Euler: from the unconstrained positions x~
/// (burning paper, eq. 9) the step ends at
///
///     x = argmin sum_i m_i |x_i - x~_i|^2 / (2 h^2) + sum_s k_s (d_s - l_s)^2 / 2 + c_s (d_s - d_s(start))^2 / (2 h),
///
/// with the length d of a spring, its target length l and its dashpot c.
///
/// By itself it is the mass-spring sheet that the burning paper compares with successive fast projection (section 8,
/// Fig. 7 b, d): active springs of every colour are equally stiff.
class SpringSheet : public MassPart {
 public:
  /// The sheet must outlive this object. Collective.
  /// @param pinned local particles that never move @param usual_h usual length of a step [s]
  /// @param others further potentials of the particles' positions; must outlive this object
  SpringSheet(const Sheet& sheet, const SpringOptions& options, const std::vector<bool>& pinned, double usual_h,
              const std::vector<Potential*>& others);

  /// Sets lengths and stiffness of a step. Not collective.
  virtual void set_shape(const SheetInput& input);
  /// Begins a step. Collective. @param positions x~ [m], pinned particles in their places; ghosts up to date
  void begin(const Field& positions, const SheetInput& input);
  bool suits_patches() const override { return suits_patches_; }
  double rounding() const override;

  /// Stiffness with which statics holds each particle at the step's start, so that rigid motions are determined: a
  /// millionth of the undeformed tangent's diagonal [N/m].
  double holding_stiffness() const { return 1e-6 * rest_stiffness_; }
  /// Whether the owned springs of each colour have stiffness. Not collective.
  const std::array<std::vector<bool>, 4>& bearing_springs(const ActiveSet& active);
  /// Forces of the owned springs by colour at some positions, with the lengths and stiffness of the last step, positive
  /// where they pull [N]. Not collective.
  std::array<std::vector<double>, 4> spring_forces(const Field& positions) const { return springs_.forces(positions); }
  /// Elastic energy with the lengths and stiffness of the last step, without viscosity [J]. Collective.
  double elastic_energy(const Field& positions) const;
  /// The elastic potentials of the sheet, viscosity included.
  virtual std::vector<const Potential*> of_shape() const { return {&springs_}; }
  /// Work of viscosity in the last step, at most 0 [J]. Collective. @param positions at its end
  double viscous_work(const Field& positions) const;

 protected:
  /// @param damping viscosity over stiffness [s] @param tolerance StepPart::tolerance
  SpringSheet(const Sheet& sheet, double damping, double tolerance, const std::vector<bool>& pinned, double usual_h,
              const std::vector<Potential*>& others);
  /// Finds the scales of stiffness; to be called after all potentials have been made. Collective.
  void set_scales();
  /// Stiffness of the local springs by colour, 0 of those that do not act [N/m].
  virtual const std::array<std::vector<double>, 4>& stiffness(const ActiveSet& active);
  /// This rank's fractions of elastic and viscous energy [J].
  virtual double own_elastic_energy(const Field& positions) const { return springs_.elastic_energy(positions); }
  virtual double own_viscous_energy(const Field& positions) const { return springs_.viscous_energy(positions); }

  const Sheet& sheet_;
  double damping_;
  SpringPotential springs_;

 private:
  double equal_stiffness_ = 0;  ///< of every active spring, unless a derived class overrides it [N/m]
  std::array<std::vector<double>, 4> equal_stiffnesses_;
  std::array<std::vector<bool>, 4> bears_;  ///< see bearing_springs; kept so that a step allocates nothing
  double negligible_force_ = 0;             ///< norm of a negligible residual [N]
  double rest_stiffness_ = 0;               ///< root of the mean square of the undeformed tangent's diagonal [N/m]
  bool suits_patches_ = false;
};

/// StepPart of a sheet as a material: a SpringSheet with the material's tensile and shear stiffness (SheetSprings),
/// bending stiffness, and viscosity relative to the step's start.
///
/// The energy of a strain limit (StrainLimit) is continued smoothly beyond a fraction of the limit; the step is
/// balanced again with larger shares until no spring is beyond the fraction, so that the energy is exact. So a step may
/// start beyond the limit.
///
/// The springs shrink with the mean of both layers; the difference between the layers bends the sheet.
class ElasticSheet : public SpringSheet {
 public:
  /// The sheet must outlive this object. Collective.
  /// @param layer_distance as in BendingPotential::Input @param factors of the material's textures
  /// @param pinned local particles that never move @param clamped pinned particles at which an edge keeps its direction
  /// @param others further potentials of the particles' positions; must outlive this object
  ElasticSheet(const Sheet& sheet, const SheetMaterial& material, double layer_distance, const MaterialFactors& factors,
               const std::vector<bool>& pinned, const std::vector<bool>& clamped, const ElasticOptions& options,
               const std::vector<Potential*>& others = {});

  void set_shape(const SheetInput& input) override;
  /// Largest ratio of the stiffness along a side of a cell to the given one, over all ranks. Collective.
  double largest_excess() const;
  std::vector<const Potential*> of_shape() const override { return {&springs_, &bending_}; }

 private:
  const std::array<std::vector<double>, 4>& stiffness(const ActiveSet& active) override {
    return material_.stiffness(active);
  }
  double own_elastic_energy(const Field& positions) const override {
    return SpringSheet::own_elastic_energy(positions) + bending_.value(positions) - bending_.viscous_energy(positions);
  }
  double own_viscous_energy(const Field& positions) const override {
    return SpringSheet::own_viscous_energy(positions) + bending_.viscous_energy(positions);
  }

  double layer_distance_;
  std::array<double, 2> bending_stiffness_;
  std::vector<double> bending_factor_;  ///< of the local particles
  std::optional<StrainLimit> limit_;
  SheetSprings material_;
  BendingPotential bending_;
  std::vector<double> bent_factor_;  ///< on the bending stiffness of the local particles in the present step, with char
};

}  // namespace pellicle::elastic
