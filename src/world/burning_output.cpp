#include "world/burning_output.h"

#include <algorithm>
#include <array>

#include "heat/heat_balance.h"

namespace pellicle {

const std::vector<History::Column>& burning_columns() {
  static const std::vector<History::Column> columns{{"mass_left", "kg"},   {"mass_burnt", "kg"},    {"pieces", ""},
                                                    {"heat_content", "J"}, {"heat_in", "J"},        {"heat_out", "J"},
                                                    {"heat_made", "J"},    {"temperature_max", "K"}};
  return columns;
}

std::vector<double> burning_row(const Surface& surface, const BurningFields& fields, double capacity) {
  double mass = 0;
  double hottest = 0;
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    const double m = fields.mass.data()[i];
    mass += m;
    if (m > 0) {
      hottest = std::max(hottest, fields.temperature.data()[i]);
    }
  }
  std::array<double, 6> sums{
      mass,           fields.mass_burnt, heat_content(surface, fields.mass, fields.temperature, capacity),
      fields.heat_in, fields.heat_out,   fields.heat_made};
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 6, MPI_DOUBLE, MPI_SUM, surface.comm());
  MPI_Allreduce(MPI_IN_PLACE, &hottest, 1, MPI_DOUBLE, MPI_MAX, surface.comm());
  const auto pieces = static_cast<double>(fields.pieces.present.size());
  return {sums[0], sums[1], pieces, sums[2], sums[3], sums[4], sums[5], hottest};
}

PieceTable::PieceTable(const ObjectOutput& output, const Hdf5File* resumed)
    : table_(output.folder, output.table("pieces"),
             {{"time", "s"}, {"step", ""}, {"piece", ""}, {"birth_time", "s"}, {"mass", "kg"}}, resumed) {}

void PieceTable::add(double time, int step, const Pieces& pieces, const std::vector<double>& masses) {
  for (std::size_t i = 0; i < masses.size(); ++i) {
    table_.add(
        {time, static_cast<double>(step), static_cast<double>(pieces.present[i]), pieces.birth_time[i], masses[i]});
  }
}

PieceFields::PieceFields(const Surface& surface, const Pieces& pieces, const std::vector<double>& masses) {
  const auto per_element = static_cast<std::size_t>(surface.triangles_per_element);
  for (std::size_t t = 0; t < surface.triangles.size(); t += per_element) {
    const PetscInt id = pieces.of_particle[static_cast<std::size_t>(surface.triangles[t].back())];
    const bool is_present = id >= 0;
    id_.push_back(static_cast<double>(id));
    mass_.push_back(is_present ? masses[pieces.place_of(id)] : 0);
    birth_time_.push_back(is_present ? pieces.birth_time[pieces.place_of(id)] : 0);
  }
}

std::vector<DrawnField> PieceFields::drawn() const {
  return {{"piece", 1, id_.data()}, {"piece_mass", 1, mass_.data()}, {"piece_birth_time", 1, birth_time_.data()}};
}

}  // namespace pellicle
