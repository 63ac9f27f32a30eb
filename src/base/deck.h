#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/object_tables.h"
#include "base/petsc_options.h"

namespace pellicle {
inline namespace base {

/// A YAML file of options.
struct Deck {
  std::string path;
  std::string text;
  std::string copy_of = {};   ///< of a deck that a run has kept: the absolute path of the file that it is a copy of
  bool is_laid_over = false;  ///< over a deck before it

  /// The file that the deck comes from: its name becomes the run's, and relative names of files start at its folder.
  const std::string& source() const { return copy_of.empty() ? path : copy_of; }
};

/// What the record of a run, the run.yaml beside a deck, says that the deck is a copy of; empty if there is none.
std::string original_of(const std::string& path);

/// The tables of a run of these decks: of the objects that they name, `objects: {NAME: {...}}`, in that order; or of
/// one without a name.
/// @param one table of a run without named objects
/// @param make_table makes that of a named object; it must outlive the result
/// @throws Error, one line with file and line, if the objects are no map or a name is no word
ObjectTables tables_of(const std::vector<Deck>& decks, OptionTable& one,
                       const std::function<OptionTable&(const std::string& object)>& make_table);

/// Sets the options that a deck gives; PETSc's own are put into `petsc`. Options at the top of the deck are given to
/// all objects of the run, then those in one of `objects` to that object. Named objects, such as bodies, are created.
/// Keys that an earlier deck has set are set anew. A map may take over the entries of others by `<<: *map`.
/// @returns whether the deck sets an option or names an object
/// @throws Error, one line with file, line, key, value and what was expected: YAML that cannot be parsed, a key that is
/// unknown (with the nearest valid one) or there twice, aliases that contain themselves or multiply, a wrong type,
/// unit, length of a list, or a value out of range.
bool read_deck(const Deck& deck, const ObjectTables& tables, std::vector<PetscOption>& petsc);

/// A deck that sets every option that acts to its present value in SI, with its unit as a comment, and PETSc's own.
std::string written_deck(const ObjectTables& tables, const std::vector<PetscOption>& petsc);

/// An option to which two written decks give different values.
struct ChangedOption {
  std::string key;
  std::string before;  ///< as it is written; empty: it is not given
  std::string now;
};

/// What differs between the texts of two written decks, in the order of the keys. @throws Error on what is no deck
std::vector<ChangedOption> changed_options(const std::string& before, const std::string& now);

}  // namespace base
}  // namespace pellicle
