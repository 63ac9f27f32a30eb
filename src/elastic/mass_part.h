#pragma once

#include <vector>

#include "energies/step_part.h"
#include "geometry/projectors.h"
#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle::elastic {

/// Inertia as a potential, U = sum_i m_i |x_i - x~_i|^2 / (2 h^2), with the positions x~ without forces. No
/// communication.
class Inertia : public Potential {
 public:
  /// The layout must outlive this object.
  explicit Inertia(const Layout& vertices);

  /// Sets the data of a step. @param free x~ [m] @param mass function of an owned vertex's number [kg] @param h [s]
  template <class Mass>
  void set(const Field& free, const Mass& mass, double h) {
    free_ = free.values().leftCols(free_.cols());
    for (std::size_t i = 0; i < rows_.entries.size(); ++i) {
      rows_.entries[i] = mass(i) / (h * h);
    }
  }
  /// m_i / h^2 of the owned vertices [N/m]
  const std::vector<double>& stiffness() const { return rows_.entries; }
  /// x~ of the owned vertices [m]
  const Eigen::Matrix3Xd& free() const { return free_; }

  double value(const Field& x) const override;
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override { add_value_and_gradient(x, gradient); }
  double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override { return diagonal_pairs(vertices_); }
  void update_hessian(const Field& /*x*/, double /*psd_blend*/) override {}
  void add_hessian(const HessianBlocks& blocks) const override;
  bool has_terms() const override { return true; }
  void visit(HessianTerms& terms) const override { terms.add_numbers(rows_); }

 private:
  const Layout& vertices_;
  NumberRows rows_;  ///< the diagonal
  Eigen::Matrix3Xd free_;
};

/// The data of a step of a MassPart, besides the positions x~ of the masses without forces.
struct MassInput {
  const std::vector<double>& mass;  ///< of the local particles, 0 where one has been removed [kg]
  const Field& start;               ///< positions at the beginning of the step, which must outlive the step [m]
  double h = 0;                     ///< to the positions where forces are in balance [s]
  double inertia_h = h;             ///< inertia is m_i / inertia_h^2; of implicit Euler h [s]
};

/// StepPart of masses with inertia and further potentials U of their positions:
///
///     sum_i m_i |x_i - x~_i|^2 / (2 h^2) + U(x).
///
/// By itself it is a projected sheet with contact: x~ are the projected positions, and U is the contact with itself or
/// other objects.
class MassPart : public PartOfPotentials {
 public:
  /// The surface must outlive this object. Collective.
  /// @param pinned local particles that never move @param tolerance StepPart::tolerance
  /// @param usual_h usual length of a step, for the scale of forces [s] @param others potentials U; must outlive this
  /// object
  MassPart(const Surface& surface, const std::vector<bool>& pinned, double tolerance, double usual_h,
           const std::vector<Potential*>& others);

  /// Begins a step. Collective.
  /// @param positions x~ [m], pinned particles in their places; ghosts up to date
  void begin(const Field& positions, const MassInput& input);
  const Projectors& projectors() const override { return projectors_; }
  const Field& start() const override { return *start_; }
  bool leaves_held_behind() override;
  bool blends() const override { return true; }
  bool suits_patches() const override { return false; }
  /// Rounding of inertia, which is large in short steps.
  double rounding() const override { return rounding_of(mean_mass_ / (h_ * h_)); }

 protected:
  /// Sets the inertia of a step. Not collective.
  void set_masses(const Field& positions, const MassInput& input);
  /// Norm of the forces that follow from rounding of positions. @param stiffness mean over the particles [N/m]
  double rounding_of(double stiffness) const;

  const Surface& surface_;
  Inertia inertia_;
  Projectors projectors_;         ///< of the local particles: 0 where one is pinned
  double mean_mass_ = 0;          ///< [kg]
  double h_;                      ///< of the step [s]
  const Field* start_ = nullptr;  ///< positions at the beginning of the step in progress
};

}  // namespace pellicle::elastic
