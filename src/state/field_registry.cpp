#include "state/field_registry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "base/error.h"
#include "parallel/collective.h"
#include "state/hdf5_file.h"
#include "state/sorted_rows.h"

namespace pellicle::state {

namespace {

template <class Values>
constexpr bool is_on_items = !std::is_arithmetic_v<Values> && !std::is_same_v<Values, Eigen::VectorXd>;

/// Stored type of a number of a field: a flag is a byte.
template <class Values>
using Kept = std::conditional_t<std::is_same_v<Values, std::vector<bool>>, unsigned char,
                                std::conditional_t<std::is_same_v<Values, std::vector<PetscInt>>, PetscInt, double>>;

/// A number of a field on items, by its place among the numbers of all local items.
template <class Values>
decltype(auto) number(Values& values, std::size_t place) {
  if constexpr (std::is_same_v<std::remove_const_t<Values>, Field>) {
    return (values.data()[place]);
  } else {
    return values[place];
  }
}

/// Calls `visit(entry, values)` for the fields on particles or cells that do not follow from others, in their order.
template <class Visit>
void for_each_on_items(const FieldRegistry& fields, Item item, const Visit& visit) {
  for (const FieldRegistry::Entry& entry : fields.entries()) {
    if (entry.declaration.item == item && !entry.declaration.follows) {
      std::visit(
          [&](auto* values) {
            if constexpr (is_on_items<std::remove_pointer_t<decltype(values)>>) {
              visit(entry, *values);
            }
          },
          entry.storage);
    }
  }
}

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
  Records records(record_size(item), item == Item::particle ? particles_->owned : cells_);
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

std::vector<std::pair<std::string, double>> differences(MPI_Comm comm, const FieldRegistry& one,
                                                        const FieldRegistry& other) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  std::vector<std::pair<std::string, double>> result;
  for (const FieldRegistry::Entry& entry : one.entries()) {
    const FieldRegistry::Entry* counterpart = other.find(entry.declaration.name);
    if (counterpart == nullptr) {
      refuse_other_fields();
    }
    const std::vector<double> a = numbers_of(entry);
    const std::vector<double> b = numbers_of(*counterpart);
    double difference = a.size() == b.size() ? 0 : 1;
    double largest = 1e-300;
    for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) {
      const double distance = a[k] == b[k] || (std::isnan(a[k]) && std::isnan(b[k])) ? 0 : std::abs(a[k] - b[k]);
      difference = std::max(difference, std::isnan(distance) ? infinity : distance);  // if one is not a number
      for (const double value : {a[k], b[k]}) {
        largest = std::isfinite(value) ? std::max(largest, std::abs(value)) : largest;
      }
    }
    const auto [of_all, largest_of_all] = max_over_ranks(comm, std::array{difference, largest});
    result.emplace_back(entry.declaration.name, of_all / largest_of_all);
  }
  return result;
}

namespace {

template <class Values>
constexpr bool is_plain_list =
    std::is_same_v<Values, std::vector<double>> || std::is_same_v<Values, std::vector<PetscInt>>;

std::string group_of(const std::string& group, Item item) {
  return group + (item == Item::particle ? "/particles/"
                  : item == Item::cell   ? "/cells/"
                  : item == Item::object ? "/once/"
                                         : "/sums/");
}

void write_items(Hdf5File& file, const std::string& group, const FieldRegistry& fields, Item item,
                 const std::vector<PetscInt>& ids) {
  const SortedRows by_id(file.comm(), ids);
  file.write(group_of(group, item) + "id", by_id.sorted(ids));
  for_each_on_items(fields, item, [&](const FieldRegistry::Entry& entry, const auto& values) {
    std::vector<Kept<std::decay_t<decltype(values)>>> own(ids.size() * static_cast<std::size_t>(entry.components));
    for (std::size_t k = 0; k < own.size(); ++k) {
      own[k] = number(values, k);
    }
    file.write(group_of(group, item) + entry.declaration.name, by_id.sorted(own, entry.components), entry.components);
  });
}

/// Reads the fields of the local items. Collective. @param ids of the local items
void read_items(const Hdf5File& file, const std::string& group, FieldRegistry& fields, Item item,
                const std::vector<PetscInt>& ids) {
  file.require_equal_rows(group + (item == Item::particle ? "/particles" : "/cells"));
  const RowsOfIds rows(file.comm(), file.read<PetscInt>(group_of(group, item) + "id"), ids);
  for_each_on_items(fields, item, [&](const FieldRegistry::Entry& entry, auto& values) {
    using Number = Kept<std::decay_t<decltype(values)>>;
    const auto found =
        rows.of(file.read<Number>(group_of(group, item) + entry.declaration.name, entry.components), entry.components);
    for (std::size_t k = 0; k < found.size(); ++k) {
      number(values, k) = found[k];
    }
  });
}

/// Calls visit(entry, name of the table, values) for the values once on the object, and the sums, that do not follow
/// from others.
template <class Visit>
void for_each_on_object(const FieldRegistry& fields, const std::string& group, const Visit& visit) {
  for (const FieldRegistry::Entry& entry : fields.entries()) {
    const FieldDeclaration& declaration = entry.declaration;
    if (!declaration.follows && (declaration.item == Item::object || declaration.item == Item::sum)) {
      const std::string name = group_of(group, declaration.item) + declaration.name;
      std::visit([&](auto* values) { visit(entry, name, values); }, entry.storage);
    }
  }
}

// A field's declaration as a line: item, kind of its values, components, whether it is drawn, unit or -, name.

const std::array<const char*, 5> item_names{"particle", "cell", "spring", "object", "sum"};
const std::array<const char*, 3> drawn_names{"no", "yes", "of_both_layers"};
/// Names of the kinds of values, in the order of FieldRegistry::Storage.
const std::array<const char*, 7> kind_names{"field", "doubles", "integers", "flags", "vector", "double", "integer"};

std::string declarations_of(const FieldRegistry& fields) {
  std::ostringstream text;
  for (const FieldRegistry::Entry& entry : fields.entries()) {
    const FieldDeclaration& field = entry.declaration;
    if (!field.follows) {
      text << item_names[static_cast<std::size_t>(field.item)] << ' ' << kind_names[entry.storage.index()] << ' '
           << entry.components << ' ' << drawn_names[static_cast<std::size_t>(field.drawn)] << ' '
           << (field.unit.empty() ? "-" : field.unit) << ' ' << field.name << '\n';
    }
  }
  return text.str();
}

template <std::size_t count>
std::size_t place_of(const std::array<const char*, count>& names, const std::string& name) {
  const auto place = std::find(names.begin(), names.end(), name);
  if (place == names.end()) {
    throw Error("the fields of a checkpoint: '" + name + "' is none of the names expected here");
  }
  return static_cast<std::size_t>(place - names.begin());
}

template <class Values>
void add_field(FieldRegistry& fields, const FieldDeclaration& declaration, int components) {
  fields.add<Values>(declaration, components);
}

/// The functions that declare a field of each kind, in the order of kind_names.
const std::array adders{add_field<Field>,
                        add_field<std::vector<double>>,
                        add_field<std::vector<PetscInt>>,
                        add_field<std::vector<bool>>,
                        add_field<Eigen::VectorXd>,
                        add_field<double>,
                        add_field<PetscInt>};

/// Declares the fields that the text names and the registry lacks: fields that a program has added. Collective.
void declare_missing(FieldRegistry& fields, const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string item;
    std::string kind;
    std::string drawn;
    FieldDeclaration field;
    int components = 1;
    words >> item >> kind >> components >> drawn >> std::ws;
    std::string rest;  // A unit may have spaces, a name has none.
    std::getline(words, rest);
    const std::size_t space = rest.rfind(' ');
    field.unit = rest.substr(0, space);
    field.name = rest.substr(space + 1);
    if (fields.find(field.name) != nullptr) {
      continue;
    }
    field.item = static_cast<Item>(place_of(item_names, item));
    field.drawn = static_cast<Drawn>(place_of(drawn_names, drawn));
    field.unit = field.unit == "-" ? "" : field.unit;
    adders[place_of(kind_names, kind)](fields, field, components);
  }
}

}  // namespace

void write_fields(Hdf5File& file, const std::string& group, const FieldRegistry& fields,
                  const std::vector<PetscInt>& particle_ids, const std::vector<PetscInt>& cell_ids) {
  file.write_text(group + "/declarations", declarations_of(fields));
  write_items(file, group, fields, Item::particle, particle_ids);
  write_items(file, group, fields, Item::cell, cell_ids);
  for_each_on_object(fields, group, [&](const FieldRegistry::Entry& entry, const std::string& name, auto* values) {
    using Values = std::remove_pointer_t<decltype(values)>;
    if constexpr (std::is_arithmetic_v<Values>) {
      if (entry.declaration.item == Item::sum) {
        file.write(name, std::vector<Values>{*values});
      } else {
        file.write_once(name, std::vector<Values>{*values});
      }
    } else if constexpr (std::is_same_v<Values, Eigen::VectorXd>) {
      file.write_once(name, std::vector<double>(values->begin(), values->end()));
    } else if constexpr (is_plain_list<Values>) {
      file.write_once(name, *values);
    }
  });
}

void read_fields(const Hdf5File& file, const std::string& group, FieldRegistry& fields,
                 const std::vector<PetscInt>& particle_ids, const std::vector<PetscInt>& cell_ids) {
  declare_missing(fields, file.read_text(group + "/declarations"));
  read_items(file, group, fields, Item::particle, particle_ids);
  read_items(file, group, fields, Item::cell, cell_ids);
  const int rank = rank_of(file.comm());
  const int ranks = ranks_of(file.comm());
  for_each_on_object(fields, group, [&](const FieldRegistry::Entry& entry, const std::string& name, auto* values) {
    using Values = std::remove_pointer_t<decltype(values)>;
    const auto refuse = [&](std::size_t found, const std::string& expected) {
      throw Error(file.path() + ": table " + name + " has " + std::to_string(found) + " numbers; expected " + expected);
    };
    if constexpr (std::is_arithmetic_v<Values>) {
      const std::vector<Values> all = file.read_all<Values>(name);
      if (entry.declaration.item == Item::sum) {
        *values = all.size() == static_cast<std::size_t>(ranks) ? all[rank]
                  : rank == 0                                   ? std::accumulate(all.begin(), all.end(), Values{})
                                                                : Values{};
      } else if (all.size() == 1) {
        *values = all.front();
      } else {
        refuse(all.size(), "one");
      }
    } else if constexpr (std::is_same_v<Values, Eigen::VectorXd>) {
      const std::vector<double> all = file.read_all<double>(name);
      if (static_cast<Eigen::Index>(all.size()) != values->size()) {
        refuse(all.size(), std::to_string(values->size()));
      }
      *values = Eigen::Map<const Eigen::VectorXd>(all.data(), values->size());
    } else if constexpr (is_plain_list<Values>) {
      *values = file.read_all<typename Values::value_type>(name);
    }
  });
}

}  // namespace pellicle::state
