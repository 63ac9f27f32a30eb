#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "base/sorting.h"
#include "parallel/field.h"
#include "parallel/records.h"

namespace pellicle::state {

class Hdf5File;

/// Location of a field: on each particle, cell (element of a membrane) or spring, or once on the object, either with
/// the same value on every rank, or as a sum of parts of all ranks.
enum class Item { particle, cell, spring, object, sum };

/// Whether frames show a field: not, its values, or the mean of a particle and its surroundings in the other layer.
enum class Drawn { no, yes, of_both_layers };

/// Properties of a field. All fields are restored when a step fails, and are compared.
struct FieldDeclaration {
  std::string name;
  std::string unit;  ///< SI; empty for a pure number
  Item item = Item::particle;
  Drawn drawn = Drawn::no;
  /// Whether the field follows from others after items have moved or been read: it is neither moved nor in checkpoints.
  bool follows = false;
  /// Whether the field is an amount, such as a mass: if an item is divided each part gets a fraction.
  bool is_amount = false;
};

/// The state of an object that changes from step to step, each field declared once. Rollback, compaction, checkpoints,
/// frames and comparison use all declared fields.
///
/// Doubles with ghosts on particles are Fields; other values on local items are vectors, item after item; values once
/// on the object are a number or a vector. Addresses stay valid when the registry is moved.
class FieldRegistry {
 public:
  using Storage = std::variant<Field*, std::vector<double>*, std::vector<PetscInt>*, std::vector<bool>*,
                               Eigen::VectorXd*, double*, PetscInt*>;
  struct Entry {
    FieldDeclaration declaration;
    int components = 1;  ///< of an item
    Storage storage;
  };

  /// @param particles must outlive the registry @param cells number of the local ones
  FieldRegistry(const Layout& particles, PetscInt cells) : particles_(&particles), cells_(cells) {}
  FieldRegistry(FieldRegistry&&) = default;
  FieldRegistry(const FieldRegistry&) = delete;
  /// Copies all values, ghosts included, of fields on the same items; declares fields that the other has and this one
  /// lacks. Collective if it declares any. @throws std::logic_error if the other lacks a field, or has it in another
  /// size
  FieldRegistry& operator=(const FieldRegistry& other);

  /// Declares and allocates a field of zeros, or false. Collective for a Field.
  /// @param components of an item; of a vector on the object its size
  template <class Values>
  Values& add(FieldDeclaration declaration, int components = 1) {
    Values& values = own<Values>();
    if constexpr (std::is_same_v<Values, Field>) {
      values = Field(*particles_, components);
    } else if constexpr (std::is_same_v<Values, Eigen::VectorXd>) {
      values.setZero(components);
    } else if constexpr (!std::is_arithmetic_v<Values>) {
      const Item item = declaration.item;
      const PetscInt items = item == Item::particle ? particles_->local() : item == Item::cell ? cells_ : 1;
      values.resize(items * components);
    }
    declare(std::move(declaration), values, components);
    return values;
  }
  /// Declares a field that is a part of an object made by `own`.
  template <class Values>
  void declare(FieldDeclaration declaration, Values& values, int components = 1) {
    entries_.push_back({std::move(declaration), components, &values});
  }
  /// Makes and owns an object that is more than one field; its parts must be declared.
  template <class Value, class... Arguments>
  Value& own(Arguments&&... arguments) {
    auto value = std::make_shared<Value>(std::forward<Arguments>(arguments)...);
    owned_.push_back(value);
    return *value;
  }
  /// Takes over from the registry of the same object on other items: declares fields that only the other has, and
  /// copies values once on the object. Collective.
  void transfer(const FieldRegistry& other);

  const std::vector<Entry>& entries() const { return entries_; }
  /// The field of a name, or null.
  const Entry* find(const std::string& name) const {
    return first_that(entries_, [&name](const Entry& entry) { return entry.declaration.name == name; });
  }

  // Records of items for moves and checkpoints: all fields of an item that do not follow from others.

  /// Bytes of the record of a particle or cell.
  std::size_t record_size(Item item) const;
  /// Writes the record of a local item. @param record (record_size)
  /// @param fraction of the item in the record, by which amounts are multiplied
  void pack(Item item, PetscInt local, std::byte* record, double fraction = 1) const;
  /// The records of all owned particles or cells.
  Records packed(Item item) const;
  /// Sets the fields of the local items from their records.
  void unpack(Item item, const Records& records);

 private:
  const Layout* particles_;
  PetscInt cells_;
  std::vector<Entry> entries_;
  std::vector<std::shared_ptr<void>> owned_;
};

/// All numbers of a field, ghosts included, as doubles. Not collective.
std::vector<double> numbers_of(const FieldRegistry::Entry& entry);

/// For each field the largest difference of two numbers over the largest finite number in either registry, of all
/// ranks; 0 for equal or no numbers, infinite where only one of the two is finite or a number. Collective.
/// @throws std::logic_error if the registries have different fields
std::vector<std::pair<std::string, double>> differences(MPI_Comm comm, const FieldRegistry& one,
                                                        const FieldRegistry& other);

// The fields of an object as tables of a file: GROUP/particles/NAME and GROUP/cells/NAME have a row an item, in the
// order of the persistent ids, GROUP/once/NAME values once on the object, GROUP/sums/NAME a row a rank. Fields that
// follow from others are left out.

/// Writes the fields. Collective. @throws Error, on all ranks
/// @param particle_ids, cell_ids persistent, of the owned items
void write_fields(Hdf5File& file, const std::string& group, const FieldRegistry& fields,
                  const std::vector<PetscInt>& particle_ids, const std::vector<PetscInt>& cell_ids);

/// Reads the fields of a registry, and those that a program had added before it was written, ghosts included, except
/// those that follow from others; sums are read by rank if as many ranks have written them, otherwise rank 0 gets all.
/// Collective.
/// @param particle_ids, cell_ids persistent, of the local items
/// @throws Error, on all ranks, if a field has no table of its kind, or an item has no row
void read_fields(const Hdf5File& file, const std::string& group, FieldRegistry& fields,
                 const std::vector<PetscInt>& particle_ids, const std::vector<PetscInt>& cell_ids);

}  // namespace pellicle::state
