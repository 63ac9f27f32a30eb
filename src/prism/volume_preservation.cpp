#include "prism/volume_preservation.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "base/units.h"
#include "parallel/collective.h"
#include "surface/membrane.h"

namespace pellicle::prism {

PrismVolume prism_volume(const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, const Eigen::Vector3d& e14) {
  PrismVolume volume;
  volume.gradient.col(0) = 0.5 * (e14 - e12).cross(e13 - e12);
  volume.gradient.col(1) = 0.5 * e13.cross(e14);
  volume.gradient.col(2) = 0.5 * e14.cross(e12);
  volume.gradient.col(3) = 0.5 * e12.cross(e13);
  volume.value = e14.dot(volume.gradient.col(3));
  return volume;
}

Eigen::Vector3d edge_to_virtual_vertex(const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, double thickness) {
  return (e12 + e13) / 3 + thickness * e12.cross(e13).normalized();
}

VolumePreservation::VolumePreservation(const Membrane& membrane, const Wall& wall, const Projectors& projectors,
                                       const VolumeOptions& options)
    : membrane_(&membrane),
      wall_(&wall),
      projectors_(&projectors),
      options_(options),
      piece_(membrane.particles.owned, 0) {
  std::vector<double> mass(piece_.size(), 0.0);
  Eigen::MatrixX3d sums = Eigen::MatrixX3d::Zero(membrane.pieces(), 3);
  // A row a piece: volumes, inverse masses, vertices.
  for (PetscInt e = 0; e < membrane.elements.local(); ++e) {
    const int piece = membrane.piece[e];
    const double element_mass = wall.density[e] * wall.rest[e].volume;
    for (const PetscInt corner : membrane.triangles[e]) {
      if (corner < membrane.particles.owned) {
        mass[corner] += element_mass / 6;
        piece_[corner] = piece;
      }
    }
    virtual_inverse_mass_.push_back(2 / element_mass);
    if (e < membrane.elements.owned) {
      sums.row(piece) += Eigen::RowVector3d(wall.rest[e].volume, virtual_inverse_mass_[e], 1);
    }
  }
  for (std::size_t i = 0; i < mass.size(); ++i) {
    inverse_mass_.push_back(1 / mass[i]);
    sums.row(piece_[i]) += Eigen::RowVector3d(0, inverse_mass_[i], 1);
  }
  sum_over_ranks(membrane.comm(), sums);
  initial_volume_ = sums.col(0);
  mean_inverse_mass_ = sums.col(1).cwiseQuotient(sums.col(2));
}

VolumePreservation::Constraint VolumePreservation::evaluate(const Field& positions,
                                                            const std::vector<double>& thickness_ratio) const {
  const Membrane& membrane = *membrane_;
  const PetscInt elements = membrane.elements.local();
  Constraint constraint;
  constraint.gradient = Eigen::Matrix3Xd::Zero(3, membrane.particles.owned);
  constraint.virtual_gradient.resize(3, elements);
  constraint.virtual_vertices.resize(3, elements);
  // A row a piece: volumes, squared norms of the gradients.
  Eigen::MatrixX2d sums = Eigen::MatrixX2d::Zero(initial_volume_.size(), 2);
  const auto weight = [this](double inverse_mass) { return options_.rule == VolumeRule::mass ? inverse_mass : 1.0; };
  for (PetscInt e = 0; e < elements; ++e) {
    const auto& corners = membrane.triangles[e];
    const auto [e12, e13] = edges_of(positions.data(), corners);
    const Eigen::Vector3d e14 = edge_to_virtual_vertex(e12, e13, thickness_ratio[e] * wall_->thickness[e]);
    const PrismVolume volume = prism_volume(e12, e13, e14);
    for (int k = 0; k < 3; ++k) {
      if (corners[k] < membrane.particles.owned) {
        constraint.gradient.col(corners[k]) += volume.gradient.col(k);
      }
    }
    constraint.virtual_gradient.col(e) = volume.gradient.col(3);
    constraint.virtual_vertices.col(e) = positions.vector(corners[0]) + e14;
    if (e < membrane.elements.owned) {
      sums(membrane.piece[e], 0) += volume.value;
      sums(membrane.piece[e], 1) += weight(virtual_inverse_mass_[e]) * volume.gradient.col(3).squaredNorm();
    }
  }
  for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
    auto gradient = constraint.gradient.col(i);
    gradient = ((*projectors_)[i] * gradient).eval();
    sums(piece_[i], 1) += weight(inverse_mass_[i]) * gradient.squaredNorm();
  }
  sum_over_ranks(membrane.comm(), sums);
  constraint.value = sums.col(0) - initial_volume_;
  constraint.squared_norm = sums.col(1);
  for (const double error : constraint.value.cwiseAbs().cwiseQuotient(initial_volume_).eval()) {
    // Not std::max, which would hide an error that is not a number.
    constraint.error = error <= constraint.error ? constraint.error : error;
  }
  return constraint;
}

void VolumePreservation::correct(Field& positions, std::vector<double>& thickness_ratio,
                                 const Constraint& constraint) const {
  constexpr double least_part = 0.1;  // of its thickness, which an element keeps in one correction
  const auto multiplier = [&](int piece, double inverse_mass) {
    const double relative = inverse_mass / mean_inverse_mass_[piece];
    const double factor = options_.rule == VolumeRule::mass      ? inverse_mass
                          : options_.rule == VolumeRule::printed ? relative * inverse_mass
                                                                 : relative;
    return factor * constraint.value[piece] / constraint.squared_norm[piece];
  };
  for (PetscInt i = 0; i < membrane_->particles.owned; ++i) {
    positions.vector(i) -= multiplier(piece_[i], inverse_mass_[i]) * constraint.gradient.col(i);
  }
  positions.update_ghosts();
  for (PetscInt e = 0; e < membrane_->elements.local(); ++e) {
    const auto& corners = membrane_->triangles[e];
    const Eigen::Vector3d moved =
        constraint.virtual_vertices.col(e) -
        multiplier(membrane_->piece[e], virtual_inverse_mass_[e]) * constraint.virtual_gradient.col(e);
    const auto [e12, e13] = edges_of(positions.data(), corners);
    // The prism's volume over its area: the height of the virtual vertex.
    const double ratio = (moved - positions.vector(corners[0])).dot(e12.cross(e13).normalized()) / wall_->thickness[e];
    thickness_ratio[e] = std::max(ratio, least_part * thickness_ratio[e]);
  }
}

StageResult VolumePreservation::advance(Field& positions, std::vector<double>& thickness_ratio) const {
  const Eigen::MatrixXd positions_before = positions.values();
  const std::vector<double> thickness_before = thickness_ratio;
  StageResult result;
  Constraint constraint = evaluate(positions, thickness_ratio);
  result.error = constraint.error;
  while (!(result.error <= options_.tolerance) && result.iterations < options_.max_iterations) {
    correct(positions, thickness_ratio, constraint);
    ++result.iterations;
    constraint = evaluate(positions, thickness_ratio);
    const double last_error = result.error;
    result.error = constraint.error;
    if (!(result.error < last_error)) {
      result.converged = false;
      result.reason = "volume preservation diverged: correction " + std::to_string(result.iterations) +
                      " changed the relative error of the rubber's volume from " + number_text(last_error) + " to " +
                      number_text(result.error);
      positions.values() = positions_before;
      thickness_ratio = thickness_before;
      break;
    }
  }
  return result;
}

}  // namespace pellicle::prism
