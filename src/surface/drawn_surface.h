#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "geometry/pressure_load.h"
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

/// Places of the points of an element's surface triangles; a quad's centre is at the mean of its corners.
class DrawnPlaces {
 public:
  /// @param positions of the local particles, (3 x local) [m]
  DrawnPlaces(const Surface& surface, const double* positions, std::size_t element)
      : x_(positions, 3, surface.particles.local()), has_centre_(surface.has_quads()) {
    if (has_centre_) {
      const std::array<PetscInt, 4>& cell = surface.cells[element];
      centre_ = 0.25 * (x_.col(cell[0]) + x_.col(cell[1]) + x_.col(cell[2]) + x_.col(cell[3]));
    }
  }
  std::array<Eigen::Vector3d, 3> operator()(const std::array<PetscInt, 3>& triangle) const {
    return {x_.col(triangle[0]), x_.col(triangle[1]), has_centre_ ? centre_ : Eigen::Vector3d(x_.col(triangle[2]))};
  }

 private:
  Eigen::Map<const Eigen::Matrix3Xd> x_;
  bool has_centre_;
  Eigen::Vector3d centre_;
};

/// Places of the points of one surface triangle. @param positions as of DrawnPlaces
inline std::array<Eigen::Vector3d, 3> places_of_triangle(const Surface& surface, const double* positions,
                                                         std::size_t triangle) {
  return DrawnPlaces(surface, positions, surface.element_of_triangle(triangle))(surface.triangles[triangle]);
}

/// Area times normal of an element, of a quad that of its diagonals [m^2]. @param positions as of DrawnPlaces
inline Eigen::Vector3d element_area_vector(const Surface& surface, const double* positions, std::size_t element) {
  const auto corner = [&](std::size_t k) {
    return Eigen::Map<const Eigen::Vector3d>(positions + 3 * surface.corner(element, k));
  };
  return surface.has_quads() ? quad_area_vector(corner(0), corner(1), corner(2), corner(3))
                             : area_vector(corner(0), corner(1), corner(2));
}

}  // namespace pellicle::surface
