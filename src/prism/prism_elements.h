#pragma once

#include <Eigen/Core>
#include <vector>

#include "energies/potential.h"
#include "parallel/field.h"
#include "prism/metric_energy.h"
#include "prism/wall.h"

namespace pellicle::prism {

/// The elastic wall: energies and forces of all prism elements (balloon paper, section 4). No communication: ghosts of
/// positions are up to date, sums are this rank's share.
class PrismElements {
 public:
  /// Membrane and wall must outlive this object.
  PrismElements(const Membrane& membrane, const Wall& wall);

  /// Sets the effect of fire on the local elements: undeformed lengths are `length` times those of the wall, and the
  /// energy is `stiffness` times that of such an element. An element of stiffness 0 is gone: it has no energy, and its
  /// vertices may be anywhere. If both are empty all elements are as in the wall.
  void set_burnt(std::vector<double> stiffness, const std::vector<double>& length);
  /// Stiffness of a local element, as in set_burnt.
  double stiffness(std::size_t element) const { return stiffness_.empty() ? 1 : stiffness_[element]; }
  const RestMetric& rest(std::size_t element) const { return rest_.empty() ? wall_->rest[element] : rest_[element]; }

  /// Elastic energy of the owned elements [J]; infinite when one has collapsed.
  /// @param thickness_ratio h/h0 of the local elements: the ratio of ThicknessRule::fixed, a starting value otherwise
  double energy(const Field& positions, const std::vector<double>& thickness_ratio) const;

  /// Adds dU/dx of the owned vertices, minus the forces of eq. 8, to (3 x owned) `gradient` [N].
  /// @returns the energy, as `energy` does
  double add_gradient(const Field& positions, const std::vector<double>& thickness_ratio,
                      Eigen::Matrix3Xd& gradient) const;

  /// Sets h/h0 of the local elements by the rule; ThicknessRule::fixed keeps the ratio.
  void update_thickness(const Field& positions, std::vector<double>& thickness_ratio) const;

  /// Energy of a local element with derivatives by its metric. Not finite if it has collapsed.
  MetricEnergy element_energy(std::size_t element, const Field& positions, double thickness_ratio,
                              Derivatives order) const;

  /// Operations of element_energy with second derivatives for all local elements, counted as in energy_density_flops.
  double tangent_flops() const { return tangent_flops_; }
  /// Stretches and stresses of a local element that is not gone. @param e12, e13 deformed edges [m]
  PrincipalState principal(std::size_t element, const Eigen::Vector3d& e12, const Eigen::Vector3d& e13,
                           double thickness_ratio) const;

  /// Cauchy stress times present thickness of the local elements, forces per present width in the wall's plane [N/m]; 0
  /// of those that are gone.
  std::vector<Eigen::Matrix3d> tensions(const Field& positions, const std::vector<double>& thickness_ratio) const;

  /// Owned elements that have collapsed (to 1e-12 of the undeformed area) or turned over (by more than 90 degrees) on
  /// the way between two positions.
  PetscInt inverted(const Field& from, const Field& to) const;

  /// Volume of the owned elements' prisms, area times thickness [m^3] (eq. 26).
  double volume(const Field& positions, const std::vector<double>& thickness_ratio) const;

  const Membrane& membrane() const { return *membrane_; }
  const Wall& wall() const { return *wall_; }

 private:
  const Membrane* membrane_;
  const Wall* wall_;
  double owned_flops_ = 0;         ///< of element_energy with first derivatives, of the owned elements
  double local_flops_ = 0;         ///< with first derivatives, of the local elements
  double tangent_flops_ = 0;       ///< with second derivatives, of the local elements
  std::vector<double> stiffness_;  ///< of the local elements, or empty for 1
  std::vector<RestMetric> rest_;   ///< of the local elements, or empty for the wall's
};

/// Interface of the stiffness K = d2U/dx2 of the local elements and of the pressure load on them, at given positions.
/// No communication.
class ElementStiffness {
 public:
  virtual ~ElementStiffness() = default;

  /// Evaluates the stiffness at positions with ghosts up to date.
  /// @param pressure on the local elements, whose load stiffness is included [Pa], or empty for none
  /// @param left_out fraction, 0 to 1, of the way from each element's exact stiffness to its positive_part
  /// (MetricStiffness alone)
  virtual void update(const Field& positions, const std::vector<double>& thickness_ratio,
                      const std::vector<double>& pressure, double left_out) = 0;

  /// Adds factor K w to `result`, both (3 x local); ghosts get only a part of their sum.
  virtual void add_product(double factor, const double* w, double* result) const = 0;

  /// Adds factor times the blocks of K, nine for each local element: corners (0, 0), (0, 1), ..., (2, 2) [N/m].
  virtual void add_blocks(double factor, const HessianBlocks& blocks) const = 0;
};

}  // namespace pellicle::prism
