#pragma once

#include <map>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "state/field_registry.h"

namespace pellicle {

/// Every field of a state as numbers, by its name.
using StateValues = std::map<std::string, std::vector<double>>;

inline StateValues values_of(const FieldRegistry& state) {
  StateValues result;
  for (const FieldRegistry::Entry& entry : state.entries()) {
    result[entry.declaration.name] = numbers_of(entry);
  }
  return result;
}

/// Makes every field another one; of what the object has a list of, one longer.
inline void spoil(const FieldRegistry& state) {
  for (const FieldRegistry::Entry& entry : state.entries()) {
    std::visit(
        [&entry](auto* values) {
          using Values = std::remove_pointer_t<decltype(values)>;
          if constexpr (std::is_same_v<Values, Field>) {
            values->values().array() += 1;
          } else if constexpr (std::is_arithmetic_v<Values>) {
            *values += 1;
          } else if constexpr (std::is_same_v<Values, Eigen::VectorXd>) {
            values->array() += 1;
          } else if constexpr (std::is_same_v<Values, std::vector<bool>>) {
            values->flip();
          } else if (entry.declaration.item == Item::object) {
            values->push_back(7);
          } else {
            for (auto& value : *values) {
              value += 1;
            }
          }
        },
        entry.storage);
  }
}

}  // namespace pellicle
