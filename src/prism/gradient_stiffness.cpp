#include "prism/gradient_stiffness.h"

#include <algorithm>

#include "base/log_event.h"
#include "geometry/pressure_load.h"
#include "surface/membrane_geometry.h"

namespace pellicle {
inline namespace prism {

namespace {

// Operations an element: of gradient_action (edges, strain, stress, forces; the shear stress where the director is left
// out) with the change of sign, and of the pressure.
double product_flops(Director director, bool has_pressure) {
  return 18 + 22 + 58 + 22 + 9 + (director == Director::left_out ? 28 : 0) +
         (has_pressure ? 1 + 12 + 2 * 9 + 6 + 9 : 0);
}

}  // namespace

GradientStiffness::GradientStiffness(const PrismElements& elements, Director director)
    : elements_(&elements), director_(director), linearised_(elements.membrane().triangles.size()) {}

void GradientStiffness::update(const Field& positions, const std::vector<double>& thickness_ratio,
                               const std::vector<double>& pressure) {
  const Wall& wall = elements_->wall();
  static const PetscLogEvent event = log_event("PrismStiffness");
  // Besides the energy, inverse edges and F, C, the shear moduli (which evaluate the density again), and stress and
  // stiffness by the inverse of a matrix (3 x 3).
  double flops = elements_->tangent_flops() + (6 + 18 + 21 + 24 + 40 + 163.0) * static_cast<double>(linearised_.size());
  for (std::size_t e = 0; e < linearised_.size(); ++e) {
    flops += energy_density_flops(wall.material_of(e));
  }
  const LogScope scope(event, flops);
  for (std::size_t e = 0; e < linearised_.size(); ++e) {
    if (elements_->stiffness(e) == 0) {
      continue;
    }
    const auto [e12, e13] = edges_of(positions.data(), elements_->membrane().triangles[e]);
    linearised_[e] = gradient_element(wall.material_of(e), wall.rule, elements_->rest(e), e12, e13, thickness_ratio[e]);
    linearised_[e].volume *= elements_->stiffness(e);
  }
  positions_ = positions.values();
  pressure_ = pressure;
}

void GradientStiffness::multiply(std::size_t element, const Eigen::Vector3d w[3], Eigen::Vector3d result[3]) const {
  if (elements_->stiffness(element) == 0) {
    std::fill_n(result, 3, Eigen::Vector3d::Zero());
    return;
  }
  gradient_action(linearised_[element], director_, w, result);
  for (int a = 0; a < 3; ++a) {
    result[a] = -result[a];
  }
  if (!pressure_.empty()) {
    const auto [x1, x2, x3] = elements_->membrane().triangles[element];
    const Eigen::Vector3d x[3] = {positions_.col(x1), positions_.col(x2), positions_.col(x3)};
    add_pressure_stiffness_action(pressure_[element], x, w, result);
  }
}

void GradientStiffness::add_product(double factor, const double* w, double* result) const {
  static const PetscLogEvent event = log_event("PrismProduct");
  constexpr double sums = 2 * 9;
  const LogScope scope(event,
                       (product_flops(director_, !pressure_.empty()) + sums) * static_cast<double>(linearised_.size()));
  using Map = Eigen::Map<Eigen::Vector3d>;
  using ConstMap = Eigen::Map<const Eigen::Vector3d>;
  for (std::size_t e = 0; e < linearised_.size(); ++e) {
    const auto [x1, x2, x3] = elements_->membrane().triangles[e];
    const Eigen::Vector3d corner[3] = {ConstMap(w + 3 * x1), ConstMap(w + 3 * x2), ConstMap(w + 3 * x3)};
    Eigen::Vector3d product[3];
    multiply(e, corner, product);
    Map(result + 3 * x1) += factor * product[0];
    Map(result + 3 * x2) += factor * product[1];
    Map(result + 3 * x3) += factor * product[2];
  }
}

void GradientStiffness::add_blocks(double factor, const HessianBlocks& blocks) const {
  static const PetscLogEvent event = log_event("PrismBlocks");
  constexpr double sums = 2 * 81;
  const double columns = 9 * product_flops(director_, !pressure_.empty());
  const LogScope scope(event, (columns + sums) * static_cast<double>(linearised_.size()));
  for (std::size_t e = 0; e < linearised_.size(); ++e) {
    for (std::size_t b = 0; b < 3; ++b) {
      Eigen::Matrix3d column[3];  // of the corners (0, b), (1, b), (2, b)
      for (int c = 0; c < 3; ++c) {
        Eigen::Vector3d w[3] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
        Eigen::Vector3d product[3];
        w[b][c] = 1;
        multiply(e, w, product);
        for (std::size_t a = 0; a < 3; ++a) {
          column[a].col(c) = product[a];
        }
      }
      for (std::size_t a = 0; a < 3; ++a) {
        blocks.add(9 * e + 3 * a + b, factor * column[a]);
      }
    }
  }
}

}  // namespace prism
}  // namespace pellicle
