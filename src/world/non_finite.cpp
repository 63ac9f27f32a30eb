#include "world/non_finite.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "parallel/collective.h"

namespace pellicle {
inline namespace world {

namespace {

/// Calls `visit` with each number of a field that is a double.
template <class Visit>
void for_each_double(const FieldRegistry::Entry& entry, const Visit& visit) {
  std::visit(
      [&visit](auto* values) {
        using Values = std::remove_pointer_t<decltype(values)>;
        if constexpr (std::is_same_v<Values, Field>) {
          std::for_each(values->data(), values->data() + values->values().size(), visit);
        } else if constexpr (std::is_same_v<Values, double>) {
          visit(*values);
        } else if constexpr (std::is_same_v<Values, std::vector<double>> || std::is_same_v<Values, Eigen::VectorXd>) {
          std::for_each(values->begin(), values->end(), visit);
        }
      },
      entry.storage);
}

}  // namespace

std::string non_finite(MPI_Comm comm, const FieldRegistry& state) {
  const auto& entries = state.entries();
  const auto first = std::find_if(entries.begin(), entries.end(), [](const FieldRegistry::Entry& entry) {
    bool is_finite = true;
    for_each_double(entry, [&is_finite](double number) { is_finite = is_finite && std::isfinite(number); });
    return !is_finite;
  });
  const auto place = min_over_ranks(comm, static_cast<int>(first - entries.begin()));
  return place == static_cast<int>(entries.size()) ? "" : "the " + entries[place].declaration.name + " is not finite";
}

bool make_finite(MPI_Comm comm, const FieldRegistry& state) {
  bool found = false;
  const auto mend = [&found](double& number) {
    found = found || !std::isfinite(number);
    number = std::isfinite(number) ? number : 0;
  };
  for (const FieldRegistry::Entry& entry : state.entries()) {
    for_each_double(entry, mend);
  }
  return on_any_rank(comm, found);
}

}  // namespace world
}  // namespace pellicle
