#include "state/field_tables.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <sstream>
#include <type_traits>

#include "base/error.h"
#include "state/sorted_rows.h"

namespace pellicle {
inline namespace state {

namespace {

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

/// Reads the values once on the object, and the sums. Collective.
void read_object_fields(const Hdf5File& file, const std::string& group, FieldRegistry& fields) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(file.comm(), &rank);
  MPI_Comm_size(file.comm(), &ranks);
  for (const FieldRegistry::Entry& entry : fields.entries()) {
    const FieldDeclaration& declaration = entry.declaration;
    if (declaration.follows || (declaration.item != Item::object && declaration.item != Item::sum)) {
      continue;
    }
    const std::string name = group_of(group, declaration.item) + declaration.name;
    std::visit(
        [&](auto* values) {
          using Values = std::remove_pointer_t<decltype(values)>;
          if constexpr (std::is_arithmetic_v<Values>) {
            const std::vector<Values> all = file.read_all<Values>(name);
            if (declaration.item == Item::object && all.size() == 1) {
              *values = all.front();
            } else if (declaration.item == Item::sum && all.size() == static_cast<std::size_t>(ranks)) {
              *values = all[rank];
            } else if (declaration.item == Item::sum) {
              *values = rank == 0 ? std::accumulate(all.begin(), all.end(), Values{}) : Values{};
            } else {
              throw Error(file.path() + ": table " + name + " has " + std::to_string(all.size()) +
                          " numbers; expected one");
            }
          } else if constexpr (std::is_same_v<Values, Eigen::VectorXd>) {
            const std::vector<double> all = file.read_all<double>(name);
            if (static_cast<Eigen::Index>(all.size()) != values->size()) {
              throw Error(file.path() + ": table " + name + " has " + std::to_string(all.size()) +
                          " numbers; expected " + std::to_string(values->size()));
            }
            *values = Eigen::Map<const Eigen::VectorXd>(all.data(), values->size());
          } else if constexpr (std::is_same_v<Values, std::vector<double>> ||
                               std::is_same_v<Values, std::vector<PetscInt>>) {
            *values = file.read_all<typename Values::value_type>(name);
          }
        },
        entry.storage);
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
    switch (place_of(kind_names, kind)) {
      case 0:
        fields.add<Field>(field, components);
        break;
      case 1:
        fields.add<std::vector<double>>(field, components);
        break;
      case 2:
        fields.add<std::vector<PetscInt>>(field, components);
        break;
      case 3:
        fields.add<std::vector<bool>>(field, components);
        break;
      case 4:
        fields.add<Eigen::VectorXd>(field, components);
        break;
      case 5:
        fields.add<double>(field, components);
        break;
      default:
        fields.add<PetscInt>(field, components);
    }
  }
}

}  // namespace

void write_fields(Hdf5File& file, const std::string& group, const FieldRegistry& fields,
                  const std::vector<PetscInt>& particle_ids, const std::vector<PetscInt>& cell_ids) {
  file.write_text(group + "/declarations", declarations_of(fields));
  write_items(file, group, fields, Item::particle, particle_ids);
  write_items(file, group, fields, Item::cell, cell_ids);
  for (const FieldRegistry::Entry& entry : fields.entries()) {
    const FieldDeclaration& declaration = entry.declaration;
    if (declaration.follows || (declaration.item != Item::object && declaration.item != Item::sum)) {
      continue;
    }
    const std::string name = group_of(group, declaration.item) + declaration.name;
    std::visit(
        [&](const auto* values) {
          using Values = std::remove_const_t<std::remove_pointer_t<decltype(values)>>;
          if constexpr (std::is_arithmetic_v<Values>) {
            if (declaration.item == Item::sum) {
              file.write(name, std::vector<Values>{*values});
            } else {
              file.write_once(name, std::vector<Values>{*values});
            }
          } else if constexpr (std::is_same_v<Values, Eigen::VectorXd>) {
            file.write_once(name, std::vector<double>(values->begin(), values->end()));
          } else if constexpr (std::is_same_v<Values, std::vector<double>> ||
                               std::is_same_v<Values, std::vector<PetscInt>>) {
            file.write_once(name, *values);
          }
        },
        entry.storage);
  }
}

void read_fields(const Hdf5File& file, const std::string& group, FieldRegistry& fields,
                 const std::vector<PetscInt>& particle_ids, const std::vector<PetscInt>& cell_ids) {
  declare_missing(fields, file.read_text(group + "/declarations"));
  read_items(file, group, fields, Item::particle, particle_ids);
  read_items(file, group, fields, Item::cell, cell_ids);
  read_object_fields(file, group, fields);
}

}  // namespace state
}  // namespace pellicle
