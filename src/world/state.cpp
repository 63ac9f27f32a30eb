#include "world/state.h"

#include <algorithm>
#include <string>

namespace pellicle {
inline namespace world {

State::State(const Sheet& sheet)
    : ObjectState(sheet.particles, {sheet.elements.owned, sheet.elements.local()}),
      BurningFields(static_cast<FieldRegistry&>(*this), sheet),
      target_length(own<TargetLengths>()) {
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    target_length[index] = sheet.of(colour).initial_length;
    declare({std::string("target_length_") + colour_names[index], "m", Item::spring, Drawn::no, true},
            target_length[index]);
  }
  position.values() = sheet.rest;
  std::fill(pin.begin(), pin.end(), -1);
  std::fill(chamber.begin(), chamber.end(), -1);
  pressure.clear();
}

}  // namespace world
}  // namespace pellicle
