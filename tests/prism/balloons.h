#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "meshing/closed_shapes.h"
#include "parallel/field.h"
#include "prism/prism_elements.h"
#include "prism/wall.h"
#include "surface/membrane.h"

namespace pellicle {

/// A number in [-1, 1] that depends on a persistent id and a component only.
inline double noise(PetscInt id, int component, int seed) {
  return std::sin(12.9898 * static_cast<double>(id + 1) + 78.233 * (component + 1) + 37.719 * seed);
}

/// A balloon from an icosphere, its wall thicker here than there. Must not be moved: its elements point into it.
struct Balloon {
  Balloon(MPI_Comm comm, int level, const WallOptions& options)
      : membrane(make_membrane(comm, icosphere_mesh(level, radius), {})),
        wall(make_wall(membrane, options, {})),
        elements(membrane, wall),
        x(membrane.particles, 3) {
    x.values() = membrane.rest;
    thickness_ratio.assign(membrane.triangles.size(), 1.0);
  }
  Balloon(const Balloon&) = delete;
  Balloon& operator=(const Balloon&) = delete;

  /// Stretches it along the axes and moves its vertices at random by up to `share` of the radius; sets the thicknesses.
  void deform(const Eigen::Vector3d& stretch, double share) {
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      const auto column = static_cast<std::size_t>(i);
      for (int c = 0; c < 3; ++c) {
        x.values()(c, i) =
            stretch[c] * membrane.rest(c, i) + share * radius * noise(membrane.persistent_id[column], c, 0);
      }
    }
    for (std::size_t e = 0; e < thickness_ratio.size(); ++e) {
      thickness_ratio[e] = 0.9 + 0.1 * noise(membrane.element_id[e], 0, 1);
    }
    elements.update_thickness(x, thickness_ratio);
  }

  /// Fire takes one element of seven away, and leaves the others softer and shorter by what their ids say.
  void burn() {
    std::vector<double> stiffness;
    std::vector<double> length;
    for (const PetscInt id : membrane.element_id) {
      stiffness.push_back(id % 7 == 0 ? 0 : 0.6 + 0.4 * noise(id, 0, 5));
      length.push_back(0.9 + 0.1 * noise(id, 1, 5));
    }
    elements.set_burnt(stiffness, length);
    elements.update_thickness(x, thickness_ratio);
  }

  /// A field of vectors of this length at most, by persistent id.
  Field random_field(double size, int seed) const {
    Field field(membrane.particles, 3);
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      for (int c = 0; c < 3; ++c) {
        field.values()(c, i) = size * noise(membrane.persistent_id[static_cast<std::size_t>(i)], c, seed);
      }
    }
    return field;
  }

  Field moved(const Field& direction, double factor) const {
    Field result(membrane.particles, 3);
    result.values() = x.values() + factor * direction.values();
    return result;
  }

  /// Elastic force on the owned vertices [N].
  Eigen::Matrix3Xd force(const Field& positions) const {
    Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, membrane.particles.owned);
    elements.add_force(positions, thickness_ratio, result);
    return result;
  }

  double summed(double share) const {
    MPI_Allreduce(MPI_IN_PLACE, &share, 1, MPI_DOUBLE, MPI_SUM, membrane.comm());
    return share;
  }

  double energy(const Field& positions) const { return summed(elements.energy(positions, thickness_ratio)); }

  /// Values of the owned vertices of all ranks by persistent id. Collective.
  Eigen::Matrix3Xd by_id(const Eigen::Matrix3Xd& owned) const {
    Eigen::Matrix3Xd all = Eigen::Matrix3Xd::Zero(3, membrane.particles.global);
    for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
      all.col(membrane.persistent_id[static_cast<std::size_t>(i)]) = owned.col(i);
    }
    MPI_Allreduce(MPI_IN_PLACE, all.data(), static_cast<int>(all.size()), MPI_DOUBLE, MPI_SUM, membrane.comm());
    return all;
  }

  static constexpr double radius = 0.1;  // [m]
  Membrane membrane;
  Wall wall;
  PrismElements elements;
  Field x;
  std::vector<double> thickness_ratio;
};

inline WallOptions wall_options(const std::string& rule, double lambda = 0) {
  WallOptions options;
  options.thickness_rule = rule;
  options.material.lambda = lambda;
  return options;
}

inline double largest(const Eigen::Matrix3Xd& values) { return values.size() == 0 ? 0 : values.cwiseAbs().maxCoeff(); }

}  // namespace pellicle
