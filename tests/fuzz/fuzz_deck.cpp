// Decks against tables with an option of each kind, one for each object that they name. What is accepted must be
// written as a deck that is read to the same values.

#include <cstdlib>
#include <iostream>

#include "options/deck.h"
#include "tests/fuzz/target.h"
#include "tests/options/options_fixture.h"

namespace {

/// Reads a deck. @returns what is written of it
std::string read_and_write(const std::string& name, const std::string& text) {
  using namespace pellicle;
  SampleOptions one;
  std::map<std::string, SampleOptions> objects;
  std::vector<PetscOption> petsc;
  const Deck deck{name, text};
  const ObjectTables tables =
      tables_of({deck}, one.table, [&](const std::string& object) -> OptionTable& { return objects[object].table; });
  read_deck(deck, tables, petsc);
  return written_deck(tables, petsc);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = pellicle::write_input(data, size, ".yaml");
  static std::string text;
  text.assign(reinterpret_cast<const char*>(data), size);
  pellicle::expect_sound(path, [](const std::string& name) {
    const std::string written = read_and_write(name, text);
    if (read_and_write(name, written) != written) {
      std::cerr << "the written deck is read otherwise:\n" << written;
      std::abort();
    }
  });
  return 0;
}
