#include "world/non_finite.h"

#include <algorithm>
#include <cmath>

namespace pellicle {

std::string non_finite(MPI_Comm comm, const std::vector<NamedValues>& quantities) {
  const auto first = std::find_if(quantities.begin(), quantities.end(), [](const NamedValues& quantity) {
    return !std::all_of(quantity.values, quantity.values + quantity.count, [](double x) { return std::isfinite(x); });
  });
  auto place = static_cast<int>(first - quantities.begin());
  MPI_Allreduce(MPI_IN_PLACE, &place, 1, MPI_INT, MPI_MIN, comm);
  if (place == static_cast<int>(quantities.size())) {
    return "";
  }
  return std::string("the ") + quantities[static_cast<std::size_t>(place)].name + " is not finite";
}

}  // namespace pellicle
