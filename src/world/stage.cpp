#include "world/stage.h"

#include "ablation/cut_surface.h"

namespace pellicle::world {

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
