#include "world/piece_fields.h"

namespace pellicle {
inline namespace world {

PieceFields::PieceFields(const Surface& surface, const Pieces& pieces, const std::vector<double>& masses) {
  const auto per_element = static_cast<std::size_t>(surface.triangles_per_element);
  for (std::size_t t = 0; t < surface.triangles.size(); t += per_element) {
    const PetscInt id = pieces.of_particle[surface.triangles[t].back()];
    const bool is_present = id >= 0;
    id_.push_back(static_cast<double>(id));
    mass_.push_back(is_present ? masses[pieces.place_of(id)] : 0);
    birth_time_.push_back(is_present ? pieces.birth_time[pieces.place_of(id)] : 0);
  }
}

std::vector<DrawnField> PieceFields::drawn() const {
  return {{"piece", 1, id_.data()}, {"piece_mass", 1, mass_.data()}, {"piece_birth_time", 1, birth_time_.data()}};
}

}  // namespace world
}  // namespace pellicle
