#include "prism/prism_elements.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/log_event.h"
#include "surface/membrane.h"

namespace pellicle::prism {

namespace {

/// An element whose area is less than this fraction of its undeformed area has collapsed.
constexpr double collapsed_area = 1e-12;

double finite_or_infinite(double energy) {
  return std::isfinite(energy) ? energy : std::numeric_limits<double>::infinity();
}

/// A n [m^2].
Eigen::Vector3d element_area(const Field& positions, const std::array<PetscInt, 3>& triangle) {
  const auto [e12, e13] = edges_of(positions.data(), triangle);
  return e12.cross(e13) / 2;
}

}  // namespace

PrismElements::PrismElements(const Membrane& membrane, const Wall& wall) : membrane_(&membrane), wall_(&wall) {
  constexpr int metric_of_corners = 6 + 15;  // two edges and their three products
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    const auto flops_of = [&](Derivatives order) {
      return metric_of_corners + metric_energy_flops(wall.material_of(e), wall.rule, order);
    };
    const int flops = flops_of(Derivatives::first);
    tangent_flops_ += flops_of(Derivatives::second);
    owned_flops_ += static_cast<PetscInt>(e) < membrane.elements.owned ? flops : 0;
    local_flops_ += flops;
  }
}

MetricEnergy PrismElements::element_energy(std::size_t element, const Field& positions, double thickness_ratio,
                                           Derivatives order) const {
  const double stiffness = this->stiffness(element);
  if (stiffness == 0) {
    return {0, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero(), thickness_ratio};
  }
  const auto [e12, e13] = edges_of(positions.data(), membrane_->triangles[element]);
  MetricEnergy energy =
      metric_energy(wall_->material_of(element), wall_->rule, rest(element), metric(e12, e13), thickness_ratio, order);
  if (stiffness != 1) {
    energy.energy *= stiffness;
    energy.gradient *= stiffness;
    if (order == Derivatives::second) {
      energy.hessian *= stiffness;
    }
  }
  return energy;
}

void PrismElements::set_burnt(std::vector<double> stiffness, const std::vector<double>& length) {
  stiffness_ = std::move(stiffness);
  rest_.clear();
  for (std::size_t e = 0; e < stiffness_.size(); ++e) {
    const double squared = length[e] * length[e];
    const RestMetric& whole = wall_->rest[e];
    rest_.push_back({whole.inverse / squared, whole.area * squared, whole.volume * squared});
  }
}

PrincipalState PrismElements::principal(std::size_t element, const Eigen::Vector3d& e12, const Eigen::Vector3d& e13,
                                        double thickness_ratio) const {
  PrincipalState state =
      principal_state(wall_->material_of(element), wall_->rule, rest(element), e12, e13, thickness_ratio);
  state.stress *= stiffness(element);
  return state;
}

std::vector<Eigen::Matrix3d> PrismElements::tensions(const Field& positions,
                                                     const std::vector<double>& thickness_ratio) const {
  std::vector<Eigen::Matrix3d> result(membrane_->triangles.size(), Eigen::Matrix3d::Zero());
  for (std::size_t e = 0; e < result.size(); ++e) {
    if (stiffness(e) != 0) {
      const auto [e12, e13] = edges_of(positions.data(), membrane_->triangles[e]);
      result[e] = tension(element_energy(e, positions, thickness_ratio[e], Derivatives::first).gradient, e12, e13);
    }
  }
  return result;
}

double PrismElements::energy(const Field& positions, const std::vector<double>& thickness_ratio) const {
  static const PetscLogEvent event = log_event("PrismEnergy");
  const LogScope scope(event, owned_flops_ + static_cast<double>(membrane_->elements.owned));
  double sum = 0;
  for (PetscInt e = 0; e < membrane_->elements.owned; ++e) {
    sum += element_energy(e, positions, thickness_ratio[e], Derivatives::first).energy;
  }
  return finite_or_infinite(sum);
}

double PrismElements::add_gradient(const Field& positions, const std::vector<double>& thickness_ratio,
                                   Eigen::Matrix3Xd& gradient) const {
  static const PetscLogEvent event = log_event("PrismGradient");
  constexpr double by_corners = 2 * 10 + 6 + 9;  // by x2 and x3, by x1, and the sums of the vertices
  const LogScope scope(event, local_flops_ + by_corners * static_cast<double>(membrane_->triangles.size()));
  const PetscInt owned = membrane_->particles.owned;
  double sum = 0;
  for (std::size_t e = 0; e < membrane_->triangles.size(); ++e) {
    const std::array<PetscInt, 3>& triangle = membrane_->triangles[e];
    const auto [e12, e13] = edges_of(positions.data(), triangle);
    const MetricEnergy energy = element_energy(e, positions, thickness_ratio[e], Derivatives::first);
    const Eigen::Vector3d& by_metric = energy.gradient;
    sum += static_cast<PetscInt>(e) < membrane_->elements.owned ? energy.energy : 0;
    // dU/dx through a = (e12.e12, e12.e13, e13.e13)
    const Eigen::Vector3d by_x2 = 2 * by_metric[0] * e12 + by_metric[1] * e13;
    const Eigen::Vector3d by_x3 = by_metric[1] * e12 + 2 * by_metric[2] * e13;
    const std::array<Eigen::Vector3d, 3> corner{-by_x2 - by_x3, by_x2, by_x3};
    for (std::size_t a = 0; a < 3; ++a) {
      if (triangle[a] < owned) {
        gradient.col(triangle[a]) += corner[a];
      }
    }
  }
  return finite_or_infinite(sum);
}

void PrismElements::update_thickness(const Field& positions, std::vector<double>& thickness_ratio) const {
  if (wall_->rule == ThicknessRule::fixed) {
    return;
  }
  for (std::size_t e = 0; e < membrane_->triangles.size(); ++e) {
    if (stiffness(e) == 0) {
      continue;
    }
    const bool keeps_volume = wall_->rule == ThicknessRule::incompressible && !wall_->material_of(e).wrinkles;
    thickness_ratio[e] = keeps_volume
                             ? rest(e).area / element_area(positions, membrane_->triangles[e]).norm()
                             : element_energy(e, positions, thickness_ratio[e], Derivatives::first).thickness_ratio;
  }
}

PetscInt PrismElements::inverted(const Field& from, const Field& to) const {
  PetscInt count = 0;
  for (PetscInt e = 0; e < membrane_->elements.owned; ++e) {
    const std::array<PetscInt, 3>& triangle = membrane_->triangles[e];
    const Eigen::Vector3d after = element_area(to, triangle);
    const bool is_fine =
        stiffness(e) == 0 || (after.norm() > collapsed_area * wall_->rest[e].area &&  // false where it is not a number
                              after.dot(element_area(from, triangle)) > 0);
    count += is_fine ? 0 : 1;
  }
  return count;
}

double PrismElements::volume(const Field& positions, const std::vector<double>& thickness_ratio) const {
  double sum = 0;
  for (PetscInt e = 0; e < membrane_->elements.owned; ++e) {
    if (stiffness(e) != 0) {
      sum += element_area(positions, membrane_->triangles[e]).norm() * thickness_ratio[e] * wall_->thickness[e];
    }
  }
  return sum;
}

}  // namespace pellicle::prism
