#include "world/non_finite.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "parallel/collective.h"

namespace pellicle {
inline namespace world {

std::string non_finite(MPI_Comm comm, const std::vector<NamedValues>& quantities) {
  const auto first = std::find_if(quantities.begin(), quantities.end(), [](const NamedValues& quantity) {
    return !std::all_of(quantity.values, quantity.values + quantity.count, [](double x) { return std::isfinite(x); });
  });
  auto place = static_cast<int>(first - quantities.begin());
  place = min_over_ranks(comm, place);
  if (place == static_cast<int>(quantities.size())) {
    return "";
  }
  return std::string("the ") + quantities[place].name + " is not finite";
}

bool make_finite(MPI_Comm comm, const FieldRegistry& state) {
  bool found = false;
  const auto mend = [&found](double& number) {
    found = found || !std::isfinite(number);
    number = std::isfinite(number) ? number : 0;
  };
  for (const FieldRegistry::Entry& entry : state.entries()) {
    std::visit(
        [&](auto* values) {
          using Values = std::remove_pointer_t<decltype(values)>;
          if constexpr (std::is_same_v<Values, Field>) {
            std::for_each(values->data(), values->data() + values->values().size(), mend);
          } else if constexpr (std::is_same_v<Values, double>) {
            mend(*values);
          } else if constexpr (std::is_same_v<Values, std::vector<double>> || std::is_same_v<Values, Eigen::VectorXd>) {
            std::for_each(values->begin(), values->end(), mend);
          }
        },
        entry.storage);
  }
  return on_any_rank(comm, found);
}

}  // namespace world
}  // namespace pellicle
