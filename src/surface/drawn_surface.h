#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle::surface {

/// A point of a surface triangle: a weighted mean of particles.
struct PointWeights {
  std::array<PetscInt, 4> particles{};  ///< local numbers
  std::array<double, 4> weights{};      ///< sum 1; 0 for unused entries
};

/// Value at a point, interpolated from those of the particles (3 x local).
template <class Values>
Eigen::Vector3d at_point(const PointWeights& point, const Values& values) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    sum += point.weights[k] * values.col(point.particles[k]);
  }
  return sum;
}
inline Eigen::Vector3d at_point(const PointWeights& point, const Field& x) { return at_point(point, x.values()); }

/// A point of the drawn surface.
struct DrawnPoint : PointWeights {
  std::int64_t id = 0;   ///< persistent; negative for a point on a cut
  bool is_owned = true;  ///< false if another rank counts the point
  /// Lattice particle of a quad's centre in which the point has the fraction `centre_share`, a quarter of it in each
  /// weight. Texture coordinates of a centre are those of its lattice particle, also beside a seam.
  PetscInt lattice = 0;
  double centre_share = 0;  ///< 0: no share in a centre
};

/// A rank's part of the drawn surface: the active triangles of its owned elements.
struct DrawnSurface {
  std::vector<DrawnPoint> points;
  std::vector<std::array<PetscInt, 3>> triangles;  ///< point numbers
  std::vector<PetscInt> elements;                  ///< local element of each triangle
};

}  // namespace pellicle::surface
