#include <cmath>
#include <functional>
#include <utility>

#include "base/error.h"
#include "world/stage.h"

namespace pellicle::world {

namespace {

/// A stage that does something at the beginning of a step.
class BeginningStage : public Stage {
 public:
  explicit BeginningStage(std::function<void(const Step&)> work) : work_(std::move(work)) {}

  StageResult begin(Step& step) override {
    work_(step);
    return {};
  }

 private:
  std::function<void(const Step&)> work_;
};

}  // namespace

StageMaker accelerating(Acceleration acceleration) {
  return [acceleration = std::move(acceleration)](const Surface& surface, State& state) {
    return std::make_unique<BeginningStage>([&surface, &state, acceleration](const Step& step) {
      for (PetscInt i = 0; i < surface.particles.local(); ++i) {  // Ghosts are moved alike: they need no exchange.
        state.velocity.vector(i) +=
            step.h * acceleration(state.position.vector(i), state.velocity.vector(i), state.time);
      }
    });
  };
}

StageMaker heating(Heating power, double capacity) {
  return [power = std::move(power), capacity](const Surface& surface, State& state) {
    if (!state.burning) {
      throw Error("an object without temperatures is to be heated, expected a sheet, or a wall that something heats");
    }
    return std::make_unique<BeginningStage>([&surface, &state, power, capacity](const Step& step) {
      BurningFields& fields = *state.burning;
      for (PetscInt i = 0; i < surface.particles.local(); ++i) {
        const double mass = fields.mass.data()[i];
        const double heat = mass * step.h * power(state.position.vector(i), state.time);  // [J]
        fields.temperature.data()[i] += mass > 0 ? heat / (mass * capacity) : 0;
        if (i < surface.particles.owned) {
          (heat > 0 ? fields.heat_in : fields.heat_out) += std::abs(heat);
        }
      }
    });
  };
}

}  // namespace pellicle::world
