// Decks against a table with an option of each kind. What is accepted must be written as a deck that is read to the
// same values.

#include <cstdlib>
#include <iostream>

#include "base/deck.h"
#include "tests/base/options_fixture.h"
#include "tests/fuzz/target.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pellicle;
  const std::string path = write_input(data, size, ".yaml");
  static std::string text;
  text.assign(reinterpret_cast<const char*>(data), size);
  expect_sound(path, [](const std::string& name) {
    SampleOptions first;
    std::vector<PetscOption> petsc;
    read_deck({name, text}, first.table, petsc);
    const std::string written = written_deck(first.table, petsc);
    SampleOptions second;
    std::vector<PetscOption> petsc_again;
    read_deck({name, written}, second.table, petsc_again);
    if (written_deck(second.table, petsc_again) != written) {
      std::cerr << "the written deck is read otherwise:\n" << written;
      std::abort();
    }
  });
  return 0;
}
