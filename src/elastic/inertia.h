#pragma once

#include <vector>

#include "energies/potential.h"

namespace pellicle {
inline namespace elastic {

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
  std::vector<VertexPair> pattern() const override;
  void update_hessian(const Field& /*x*/, Curvature /*curvature*/) override {}
  void add_hessian(const HessianBlocks& blocks) const override;
  bool multiplies() const override { return true; }
  bool has_terms() const override { return true; }
  void visit(HessianTerms& terms) const override { terms.add_numbers(rows_); }

 private:
  const Layout& vertices_;
  NumberRows rows_;  ///< the diagonal
  Eigen::Matrix3Xd free_;
};

}  // namespace elastic
}  // namespace pellicle
