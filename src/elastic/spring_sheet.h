#pragma once

#include <array>
#include <vector>

#include "elastic/elastic_options.h"
#include "elastic/sheet_part.h"
#include "elastic/spring_potential.h"

namespace pellicle::elastic {

/// StepPart of a sheet of Hooke springs with parallel dashpots, by implicit Euler: from the unconstrained positions x~
/// (burning paper, eq. 9) the step ends at
///
///     x = argmin sum_i m_i |x_i - x~_i|^2 / (2 h^2) + sum_s k_s (d_s - l_s)^2 / 2 + c_s (d_s - d_s(start))^2 / (2 h),
///
/// with the length d of a spring, its target length l and its dashpot c.
///
/// It is the mass-spring sheet that the burning paper compares with successive fast projection (section 8, Fig. 7 b,
/// d): active springs of every colour are equally stiff.
class SpringSheet : public SheetPart {
 public:
  /// The sheet must outlive this object. Collective.
  /// @param pinned local particles that never move @param usual_h usual length of a step [s]
  /// @param others further potentials of the particles' positions; must outlive this object
  SpringSheet(const Sheet& sheet, const SpringOptions& options, const std::vector<bool>& pinned, double usual_h,
              const std::vector<Potential*>& others);

  void set_shape(const SheetInput& input) override;
  /// Forces of the owned springs by colour at some positions, with the lengths and stiffness of the last step, positive
  /// where they pull [N]. Not collective.
  std::array<std::vector<double>, 4> spring_forces(const Field& positions) const { return springs_.forces(positions); }
  std::vector<const Potential*> of_shape() const override { return {&springs_}; }

 private:
  double own_elastic_energy(const Field& positions) const override { return springs_.elastic_energy(positions); }
  double own_viscous_energy(const Field& positions) const override { return springs_.viscous_energy(positions); }

  SpringPotential springs_;
  double stiffness_;  ///< of every active spring [N/m]
};

}  // namespace pellicle::elastic
