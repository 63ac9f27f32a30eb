#pragma once

#include <Eigen/Core>
#include <array>

#include "geometry/pressure_load.h"
#include "surface/surface.h"

namespace pellicle::surface {

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
