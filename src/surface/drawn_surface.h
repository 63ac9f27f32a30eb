#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "surface/surface.h"

namespace pellicle {
inline namespace surface {

/// A point of the drawn surface: a weighted mean of particles.
struct DrawnPoint {
  std::array<PetscInt, 4> particles{};  ///< local numbers
  std::array<double, 4> weights{};      ///< sum 1; 0 for particles that do not count
  std::int64_t id = 0;                  ///< persistent; negative where the surface is cut
  bool is_owned = true;                 ///< false for points that another rank counts
  /// Lattice particle of the virtual centre of which the point has this share, a quarter of it in each of the weights.
  /// A centre's texture coordinates are those of its lattice particle, also beside a seam.
  PetscInt lattice = 0;
  double centre_share = 0;  ///< 0 where there is none
};

/// What a rank draws of a surface: what is left of its owned elements.
struct DrawnSurface {
  std::vector<DrawnPoint> points;
  std::vector<std::array<PetscInt, 3>> triangles;  ///< point numbers
  std::vector<PetscInt> elements;                  ///< local element of each triangle
};

}  // namespace surface
}  // namespace pellicle
