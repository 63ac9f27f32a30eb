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
  std::array<double, 4> weights{};      ///< sum 1; 0 for unused entries
  std::int64_t id = 0;                  ///< persistent; negative for a point on a cut
  bool is_owned = true;                 ///< false if another rank counts the point
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

}  // namespace surface
}  // namespace pellicle
