#include "constraints/pins.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "geometry/key_points.h"

namespace pellicle {
inline namespace constraints {

namespace {

[[noreturn]] void refuse_second_pin(const std::string& key, const std::string& first, PetscInt id) {
  throw Error(key + ": particle " + std::to_string(id) + " is also held by pins." + first +
              ", expected each particle in one pin");
}

}  // namespace

void describe(OptionTable& table, PinOptions& options) {
  describe(table, static_cast<SelectionOptions&>(options));
  table.add("velocity", options.velocity)
      .unit("m/s")
      .acts_with({"no path", [&options] { return options.path.empty(); }})
      .help("constant velocity");
  table.add("path", options.path)
      .unit("s,m,m,m")
      .help(
          "key points (time, x, y, z) of the displacement from the undeformed place; linear between key points, at "
          "rest before and after them");
  table.add("clamped", options.clamped)
      .help(
          "holds the direction of an elastic sheet or of a balloon's wall, too, where these particles are at its edge; "
          "otherwise it turns there as on a hinge");
}

Pins::Pins(const Surface& points, const std::map<std::string, PinOptions>& options)
    : points_(&points), pinned_(points.particles.local(), false) {
  for (const auto& [name, given] : options) {
    const std::string key = "pins." + name;
    add(name, given);
    const std::vector<bool> chosen = select(points, key, given);
    std::vector<PetscInt>& particles = pins_.back().particles;
    together(points.comm(), [&] {
      for (PetscInt i = 0; i < points.particles.local(); ++i) {
        if (chosen[i] && pinned_[i]) {
          refuse_second_pin(key, pins_[numbers()[i]].name, points.persistent_id[i]);
        }
        if (chosen[i]) {
          particles.push_back(i);
          pinned_[i] = true;
        }
      }
    });
  }
}

Pins::Pins(const Surface& points, const std::map<std::string, PinOptions>& options,
           const std::vector<PetscInt>& numbers)
    : points_(&points), pinned_(numbers.size(), false) {
  for (const auto& [name, given] : options) {
    add(name, given);
  }
  hold(numbers);
}

void Pins::add(const std::string& name, const PinOptions& options) {
  if (const std::string fault = fault_of_motion(options.path, options.velocity); !fault.empty()) {
    throw Error("pins." + name + fault);
  }
  pins_.push_back({name, options.velocity, options.path, options.motion, options.clamped, {}});
}

void Pins::hold(const std::vector<PetscInt>& numbers) {
  for (Pin& pin : pins_) {
    pin.particles.clear();
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

}  // namespace constraints
}  // namespace pellicle
