#include "world/callbacks.h"

#include <cmath>
#include <utility>

#include "base/error.h"

namespace pellicle {
inline namespace world {

namespace {

class AccelerationStage : public Stage {
 public:
  AccelerationStage(const Surface& surface, State& state, Acceleration acceleration)
      : surface_(surface), state_(state), acceleration_(std::move(acceleration)) {}

  StageResult begin(Step& step) override {
    for (PetscInt i = 0; i < surface_.particles.local(); ++i) {  // Ghosts are moved alike: they need no exchange.
      state_.velocity.vector(i) +=
          step.h * acceleration_(state_.position.vector(i), state_.velocity.vector(i), state_.time);
    }
    return {};
  }

 private:
  const Surface& surface_;
  State& state_;
  Acceleration acceleration_;
};

class HeatingStage : public Stage {
 public:
  HeatingStage(const Surface& surface, State& state, Heating power, double capacity)
      : surface_(surface), state_(state), power_(std::move(power)), capacity_(capacity) {
    if (!state.burning) {
      throw Error("an object without temperatures is to be heated, expected a sheet, or a wall that something heats");
    }
  }

  StageResult begin(Step& step) override {
    BurningFields& fields = *state_.burning;
    for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
      const double mass = fields.mass.data()[i];
      const double heat = mass * step.h * power_(state_.position.vector(i), state_.time);  // [J]
      fields.temperature.data()[i] += mass > 0 ? heat / (mass * capacity_) : 0;
      if (i < surface_.particles.owned) {
        (heat > 0 ? fields.heat_in : fields.heat_out) += std::abs(heat);
      }
    }
    return {};
  }

 private:
  const Surface& surface_;
  State& state_;
  Heating power_;
  double capacity_;
};

}  // namespace

StageMaker accelerating(Acceleration acceleration) {
  return [acceleration = std::move(acceleration)](const Surface& surface, State& state) {
    return std::make_unique<AccelerationStage>(surface, state, acceleration);
  };
}

StageMaker heating(Heating power, double capacity) {
  return [power = std::move(power), capacity](const Surface& surface, State& state) {
    return std::make_unique<HeatingStage>(surface, state, power, capacity);
  };
}

}  // namespace world
}  // namespace pellicle
