#include "constraints/pins.h"

#include <iterator>

#include "base/error.h"
#include "geometry/key_points.h"

namespace pellicle::constraints {

namespace {

/// Pin of each local particle, or -1. Collective. @throws Error as the constructor of Pins does
std::vector<PetscInt> selected(const Surface& points, const std::map<std::string, PinOptions>& options) {
  std::vector<PetscInt> numbers(points.particles.local(), -1);
  PetscInt pin = 0;
  for (const auto& [name, given] : options) {
    const std::string key = "pins." + name;
    require_motion(key, given);
    const std::vector<bool> chosen = select(points, key, given);
    together(points.comm(), [&] {
      for (PetscInt i = 0; i < points.particles.local(); ++i) {
        if (chosen[i] && numbers[i] >= 0) {
          throw Error(key + ": particle " + std::to_string(points.persistent_id[i]) + " is also held by pins." +
                      std::next(options.begin(), numbers[i])->first + ", expected each particle in one pin");
        }
        numbers[i] = chosen[i] ? pin : numbers[i];
      }
    });
    ++pin;
  }
  return numbers;
}

}  // namespace

void describe(OptionTable& table, PinOptions& options) {
  describe(table, static_cast<SelectionOptions&>(options));
  table.add("velocity", options.velocity,
            Rules("m/s").acts_with({"no path", [&options] { return options.path.empty(); }}), "constant velocity");
  table.add("path", options.path, Rules("s,m,m,m"),
            "key points (time, x, y, z) of the displacement from the undeformed place; linear between key points, at "
            "rest before and after them");
  table.add("clamped", options.clamped,
            "holds the direction of an elastic sheet or of a balloon's wall, too, where these particles are at its "
            "edge; otherwise it turns there as on a hinge");
}

void require_motion(const std::string& key, const PinOptions& options) {
  if (const std::string fault = fault_of_motion(options.path, options.velocity); !fault.empty()) {
    throw Error(key + fault);
  }
}

Pins::Pins(const Surface& points, const std::map<std::string, PinOptions>& options)
    : Pins(points, options, selected(points, options)) {}

Pins::Pins(const Surface& points, const std::map<std::string, PinOptions>& options,
           const std::vector<PetscInt>& numbers)
    : points_(&points), pinned_(numbers.size(), false) {
  for (const auto& [name, given] : options) {
    require_motion("pins." + name, given);
    pins_.push_back({given.velocity, given.path, given.motion, given.clamped, {}});
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] >= 0) {
      pins_.at(numbers[i]).particles.push_back(static_cast<PetscInt>(i));
      pinned_[i] = true;
    }
  }
}

std::vector<PetscInt> Pins::numbers() const {
  std::vector<PetscInt> result(pinned_.size(), -1);
  for (std::size_t pin = 0; pin < pins_.size(); ++pin) {
    for (const PetscInt i : pins_[pin].particles) {
      result[i] = static_cast<PetscInt>(pin);
    }
  }
  return result;
}

std::vector<bool> Pins::clamped() const {
  std::vector<bool> result(pinned_.size(), false);
  for (const Pin& pin : pins_) {
    for (const PetscInt i : pin.particles) {
      result[i] = pin.is_clamp;
    }
  }
  return result;
}

void Pins::impose(Field& positions, double time) const {
  for (const Pin& pin : pins_) {
    const Eigen::Vector3d displacement = pin.motion ? pin.motion(time) : place_of_motion(pin.path, pin.velocity, time);
    for (const PetscInt i : pin.particles) {
      positions.vector(i) = points_->rest.col(i) + displacement;
    }
  }
}

}  // namespace pellicle::constraints
