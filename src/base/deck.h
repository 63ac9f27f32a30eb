#pragma once

#include <string>
#include <vector>

#include "base/options.h"
#include "base/petsc_options.h"

namespace pellicle {

/// A YAML file of options.
struct Deck {
  std::string path;
  std::string text;
};

/// Sets the options that a deck gives; PETSc's own are put into `petsc`. Objects that the deck names are created.
/// Keys that an earlier deck has set are set anew.
/// @throws Error, one line with file, line, key, value and what was expected: YAML that cannot be parsed, a key that is
/// unknown (with the nearest valid one) or there twice, a wrong type, unit, length of a list, or a value out of range.
void read_deck(const Deck& deck, OptionTable& table, std::vector<PetscOption>& petsc);

/// A deck that sets every option to its present value in SI, with its unit as a comment, and PETSc's own.
std::string written_deck(const OptionTable& table, const std::vector<PetscOption>& petsc);

}  // namespace pellicle
