#include "state/field_registry.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <type_traits>

namespace pellicle::state {

namespace {

[[noreturn]] void refuse_other_fields() { throw std::logic_error("two states have different fields"); }

}  // namespace

FieldRegistry& FieldRegistry::operator=(const FieldRegistry& other) {
  if (entries_.size() < other.entries_.size()) {
    transfer(other);
  }
  for (Entry& entry : entries_) {
    const Entry* from = other.find(entry.declaration.name);
    if (from == nullptr) {
      refuse_other_fields();
    }
    std::visit([from](auto* values) { *values = *std::get<decltype(values)>(from->storage); }, entry.storage);
  }
  return *this;
}

void FieldRegistry::transfer(const FieldRegistry& other) {
  for (const Entry& entry : other.entries_) {
    const bool is_of_object = entry.declaration.item == Item::object || entry.declaration.item == Item::sum;
    std::visit(
        [&](const auto* values) {
          using Values = std::remove_const_t<std::remove_pointer_t<decltype(values)>>;
          const Entry* own = find(entry.declaration.name);
          Values& taken =
              own == nullptr ? add<Values>(entry.declaration, entry.components) : *std::get<Values*>(own->storage);
          if (is_of_object) {
            taken = *values;
          }
        },
        entry.storage);
  }
}

const FieldRegistry::Entry* FieldRegistry::find(const std::string& name) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&name](const Entry& entry) { return entry.declaration.name == name; });
  return found == entries_.end() ? nullptr : &*found;
}

std::size_t FieldRegistry::record_size(Item item) const {
  std::size_t size = 0;
  for_each_on_items(*this, item, [&size](const Entry& entry, const auto& values) {
    size += static_cast<std::size_t>(entry.components) * sizeof(Kept<std::decay_t<decltype(values)>>);
  });
  return size;
}

void FieldRegistry::pack(Item item, PetscInt local, std::byte* record, double fraction) const {
  for_each_on_items(*this, item, [&](const Entry& entry, const auto& values) {
    for (int k = 0; k < entry.components; ++k) {
      Kept<std::decay_t<decltype(values)>> kept =
          number(values, static_cast<std::size_t>(local * entry.components + k));
      if constexpr (std::is_floating_point_v<decltype(kept)>) {
        kept *= entry.declaration.is_amount ? fraction : 1;
      }
      std::memcpy(record, &kept, sizeof kept);
      record += sizeof kept;
    }
  });
}

Records FieldRegistry::packed(Item item) const {
  Records records(record_size(item), item == Item::particle ? particles_->owned : cells_.owned);
  for (PetscInt i = 0; i < records.count(); ++i) {
    pack(item, i, records.at(i));
  }
  return records;
}

void FieldRegistry::unpack(Item item, const Records& records) {
  for (PetscInt i = 0; i < records.count(); ++i) {
    const std::byte* record = records.at(i);
    for_each_on_items(*this, item, [&](const Entry& entry, auto& values) {
      for (int k = 0; k < entry.components; ++k) {
        Kept<std::decay_t<decltype(values)>> kept{};
        std::memcpy(&kept, record, sizeof kept);
        record += sizeof kept;
        number(values, static_cast<std::size_t>(i * entry.components + k)) = kept;
      }
    });
  }
}

void FieldRegistry::make_room(Field& values, Item, int components) const { values = Field(*particles_, components); }

std::vector<double> numbers_of(const FieldRegistry::Entry& entry) {
  return std::visit(
      [](const auto* values) -> std::vector<double> {
        using Values = std::remove_const_t<std::remove_pointer_t<decltype(values)>>;
        if constexpr (std::is_same_v<Values, Field>) {
          return {values->data(), values->data() + values->values().size()};
        } else if constexpr (std::is_arithmetic_v<Values>) {
          return {static_cast<double>(*values)};
        } else {
          return {values->begin(), values->end()};
        }
      },
      entry.storage);
}

std::vector<std::pair<std::string, double>> differences(const FieldRegistry& one, const FieldRegistry& other) {
  std::vector<std::pair<std::string, double>> result;
  for (const FieldRegistry::Entry& entry : one.entries()) {
    const FieldRegistry::Entry* counterpart = other.find(entry.declaration.name);
    if (counterpart == nullptr) {
      refuse_other_fields();
    }
    const std::vector<double> a = numbers_of(entry);
    const std::vector<double> b = numbers_of(*counterpart);
    double difference = a.size() == b.size() ? 0 : 1;
    double largest = 0;
    for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) {
      // Also if only one of the two is not a number.
      const double distance = a[k] == b[k] || (std::isnan(a[k]) && std::isnan(b[k])) ? 0 : std::abs(a[k] - b[k]);
      difference = distance <= difference ? difference : distance;
      largest = std::max({largest, std::abs(a[k]), std::abs(b[k])});
    }
    result.emplace_back(entry.declaration.name, difference == 0 ? 0 : difference / std::max(largest, 1e-300));
  }
  return result;
}

}  // namespace pellicle::state
