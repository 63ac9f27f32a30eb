#pragma once

#include <functional>
#include <string>
#include <vector>

#include "options/run_options.h"

namespace pellicle::options {

/// A YAML file of options.
struct Deck {
  std::string path;
  std::string text;
  std::string copy_of = {};   ///< absolute path of the original, if the deck is a copy in a run's record
  bool is_laid_over = false;  ///< whether it is laid over an earlier deck

  /// The file that the deck comes from: its name becomes the run's, and relative names of files start at its folder.
  const std::string& source() const { return copy_of.empty() ? path : copy_of; }
};

/// Path of the original of a deck in a run's folder, from the run.yaml beside it; empty if there is none.
std::string original_of(const std::string& path);

/// The tables of a run of some decks: of the objects in `objects: {NAME: {...}}`, in that order, or of one object
/// without a name.
/// @param one table of a run without named objects
/// @param make_table makes the table of a named object, which must outlive the result
/// @throws Error, one line with file and line, if the objects are no map or a name is no word
ObjectTables tables_of(const std::vector<Deck>& decks, OptionTable& one,
                       const std::function<OptionTable&(const std::string& object)>& make_table);

/// Sets the options of a deck; PETSc's own are put into `petsc`. Options at the top of the deck apply to all objects of
/// the run, then those in one of `objects` to that object. Named objects, such as bodies, are created. Keys override
/// those of earlier decks. A map may include the entries of others by `<<: *map`.
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
  std::string before;  ///< as written; empty: not given
  std::string now;
};

/// The differences between two written decks, in the order of the keys. @throws Error on a text that is no deck
std::vector<ChangedOption> changed_options(const std::string& before, const std::string& now);

}  // namespace pellicle::options
