#include "world/stage.h"

#include <algorithm>
#include <stdexcept>

#include "ablation/cut_surface.h"

namespace pellicle::world {

double Report::at(const std::string& name) const {
  const auto found = std::find_if(columns_.begin(), columns_.end(),
                                  [&name](const History::Column& column) { return column.name == name; });
  if (found == columns_.end()) {
    throw std::logic_error("no number of the name " + name);
  }
  return values_[static_cast<std::size_t>(found - columns_.begin())];
}

const Frame& Picture::frame(const Surface& surface, const State& state, std::optional<Drawing>& whole) {
  if (cut_) {
    cut_drawing_ = drawing_of(surface, std::move(*cut_));
    cut_.reset();
    frame_.surface = &*cut_drawing_;
  } else {
    if (!whole) {
      whole = drawing_of(surface, whole_surface(surface));
    }
    frame_.surface = &*whole;
  }
  frame_.time = state.time;
  frame_.step = static_cast<int>(state.step);
  frame_.positions = state.position.data();
  const auto put_before = [&state](std::vector<DrawnField>& derived, Item item) {
    const std::vector<DrawnField> of_state = drawn_fields(state, item);
    derived.insert(derived.begin(), of_state.begin(), of_state.end());
  };
  put_before(frame_.particle_fields, Item::particle);
  put_before(frame_.cell_fields, Item::cell);
  frame_.springs = springs_ ? &*springs_ : nullptr;
  return frame_;
}

}  // namespace pellicle::world
