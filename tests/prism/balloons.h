#pragma once

#include <petscmat.h>

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/handle.h"
#include "meshing/closed_shapes.h"
#include "parallel/field.h"
#include "prism/prism_elements.h"
#include "prism/wall.h"
#include "surface/membrane.h"
#include "tests/support/by_id.h"

namespace pellicle {

/// A number in [-1, 1] that depends on a persistent id and a component only.
inline double noise(PetscInt id, int component, int seed) {
  return std::sin(12.9898 * static_cast<double>(id + 1) + 78.233 * (component + 1) + 37.719 * seed);
}

/// A wall at rest, and what tests ask of it. Must not be moved: its elements point into it.
struct TestedWall {
  TestedWall(MPI_Comm comm, const SurfaceMesh& mesh, const WallOptions& options)
      : membrane(make_membrane(comm, mesh, {})),
        wall(make_wall(membrane, options, {})),
        elements(membrane, wall),
        x(membrane.particles, 3),
        thickness_ratio(membrane.triangles.size(), 1.0) {
    x.values() = membrane.rest;
  }
  TestedWall(const TestedWall&) = delete;
  TestedWall& operator=(const TestedWall&) = delete;

  /// A field of vectors with components of this size at most, by persistent id.
  Field random_field(double size, int seed) const {
    Field field(membrane.particles, 3);
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      for (int c = 0; c < 3; ++c) {
        field.values()(c, i) = size * noise(membrane.persistent_id[i], c, seed);
      }
    }
    return field;
  }

  Field moved(const Field& direction, double factor) const {
    Field result(membrane.particles, 3);
    result.values() = x.values() + factor * direction.values();
    return result;
  }

  double summed(double fraction) const {
    MPI_Allreduce(MPI_IN_PLACE, &fraction, 1, MPI_DOUBLE, MPI_SUM, membrane.comm());
    return fraction;
  }

  /// Values of the owned vertices of all ranks by persistent id. Collective.
  Eigen::Matrix3Xd by_id(const Eigen::Matrix3Xd& owned) const { return pellicle::by_id(membrane, owned); }

  /// A w by persistent id, A of the owned vertices' coordinates. Collective.
  Eigen::Matrix3Xd product(Mat matrix, const Field& w) const {
    VecHandle in, out;
    check(MatCreateVecs(matrix, in.create(), out.create()));
    const PetscInt owned = membrane.particles.owned;
    double* values = nullptr;
    check(VecGetArrayWrite(in, &values));
    Eigen::Map<Eigen::Matrix3Xd>(values, 3, owned) = w.values().leftCols(owned);
    check(VecRestoreArrayWrite(in, &values));
    check(MatMult(matrix, in, out));
    const double* product = nullptr;
    check(VecGetArrayRead(out, &product));
    const Eigen::Matrix3Xd result = Eigen::Map<const Eigen::Matrix3Xd>(product, 3, owned);
    check(VecRestoreArrayRead(out, &product));
    return by_id(result);
  }

  Membrane membrane;
  Wall wall;
  PrismElements elements;
  Field x;
  std::vector<double> thickness_ratio;
};

/// A balloon from an icosphere, its wall thicker here than there.
struct Balloon : TestedWall {
  Balloon(MPI_Comm comm, int level, const WallOptions& options)
      : TestedWall(comm, icosphere_mesh(level, radius), options) {}

  /// Stretches it along the axes and moves its vertices at random by up to `share` of the radius; sets the thicknesses.
  void deform(const Eigen::Vector3d& stretch, double fraction) {
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      const auto column = static_cast<std::size_t>(i);
      for (int c = 0; c < 3; ++c) {
        x.values()(c, i) =
            stretch[c] * membrane.rest(c, i) + fraction * radius * noise(membrane.persistent_id[column], c, 0);
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

  /// Elastic force on the owned vertices [N].
  Eigen::Matrix3Xd force(const Field& positions) const {
    Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, membrane.particles.owned);
    elements.add_gradient(positions, thickness_ratio, result);
    return -result;
  }

  double energy(const Field& positions) const { return summed(elements.energy(positions, thickness_ratio)); }

  static constexpr double radius = 0.1;  // [m]
};

inline WallOptions wall_options(const std::string& rule, double lambda = 0) {
  WallOptions options;
  options.thickness_rule = rule;
  options.material.lambda = lambda;
  return options;
}

inline double largest(const Eigen::Matrix3Xd& values) { return values.size() == 0 ? 0 : values.cwiseAbs().maxCoeff(); }

}  // namespace pellicle
