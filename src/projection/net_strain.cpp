#include "projection/net_strain.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace pellicle {
inline namespace projection {

NetStrain net_strain(const Sheet& sheet, const Field& x, const std::array<std::vector<double>, 4>& target_length,
                     const Living& living) {
  constexpr PetscInt none = std::numeric_limits<PetscInt>::max();
  using Key = std::array<PetscInt, 3>;  // ids of the ends, colour
  NetStrain strain;
  Key key{none, none, none};
  std::array<double, 2> sum_and_count{};
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    const SpringSet& springs = sheet.of(colour);
    const bool is_of_net = std::find(net_colours.begin(), net_colours.end(), colour) != net_colours.end();
    for (std::size_t s = 0; s < static_cast<std::size_t>(springs.owned()); ++s) {
      if (!living.springs[index][s]) {
        continue;
      }
      const auto [a, b] = springs.ends[s];
      const double value = std::abs((x.vector(a) - x.vector(b)).norm() / target_length[index][s] - 1);
      sum_and_count[0] += value;
      sum_and_count[1] += 1;
      if (is_of_net && value >= strain.largest) {
        const auto [first, last] = std::minmax(sheet.persistent_id[static_cast<std::size_t>(a)],
                                               sheet.persistent_id[static_cast<std::size_t>(b)]);
        const Key own{first, last, static_cast<PetscInt>(colour)};
        if (value > strain.largest || own < key) {
          strain.largest = value;
          key = own;
          strain.place = (x.vector(a) + x.vector(b)) / 2;
        }
      }
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sum_and_count.data(), 2, MPI_DOUBLE, MPI_SUM, sheet.comm());
  strain.mean = sum_and_count[1] > 0 ? sum_and_count[0] / sum_and_count[1] : 0;

  const double own_largest = strain.largest;
  MPI_Allreduce(MPI_IN_PLACE, &strain.largest, 1, MPI_DOUBLE, MPI_MAX, sheet.comm());
  const Key own = own_largest == strain.largest ? key : Key{none, none, none};
  Key first{};  // in the order of the keys: one number after the other
  bool is_first = true;
  for (std::size_t k = 0; k < own.size(); ++k) {
    first[k] = is_first ? own[k] : none;
    MPI_Allreduce(MPI_IN_PLACE, &first[k], 1, MPIU_INT, MPI_MIN, sheet.comm());
    is_first = is_first && own[k] == first[k];
  }
  if (first[0] == none) {
    return strain;
  }
  strain.ids = {first[0], first[1]};
  strain.colour = static_cast<Colour>(first[2]);
  if (!is_first) {
    strain.place.setZero();
  }
  MPI_Allreduce(MPI_IN_PLACE, strain.place.data(), 3, MPI_DOUBLE, MPI_SUM, sheet.comm());
  return strain;
}

std::string words_of(double strain, const Eigen::Vector3d& place) {
  char text[120];
  std::snprintf(text, sizeof text, "%.3g %% at (%.4g, %.4g, %.4g) m", 100 * strain, place[0], place[1], place[2]);
  return text;
}

}  // namespace projection
}  // namespace pellicle
