#include "constraints/pins.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "geometry/key_points.h"

namespace pellicle {

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
}

Pins::Pins(const PointSet& points, const std::map<std::string, PinOptions>& options)
    : points_(&points), pinned_(static_cast<std::size_t>(points.particles.local()), false) {
  for (const auto& [name, given] : options) {
    const std::string key = "pins." + name;
    if (const std::string fault = fault_of_motion(given.path, given.velocity); !fault.empty()) {
      throw Error(key + fault);
    }
    const std::vector<bool> chosen = select(points, key, given);
    Pin pin{name, given.velocity, given.path, {}};
    for (PetscInt i = 0; i < points.particles.local(); ++i) {
      if (chosen[static_cast<std::size_t>(i)]) {
        pin.particles.push_back(i);
      }
    }
    together(points.comm(), [&] {
      for (const PetscInt i : pin.particles) {
        if (pinned_[static_cast<std::size_t>(i)]) {
          refuse_second_pin(key, pins_[static_cast<std::size_t>(numbers()[static_cast<std::size_t>(i)])].name,
                            points.persistent_id[static_cast<std::size_t>(i)]);
        }
        pinned_[static_cast<std::size_t>(i)] = true;
      }
    });
    pins_.push_back(std::move(pin));
  }
}

Pins::Pins(const Pins& other, const PointSet& points, const std::vector<PetscInt>& numbers)
    : points_(&points), pins_(other.pins_), pinned_(numbers.size(), false) {
  for (Pin& pin : pins_) {
    pin.particles.clear();
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] >= 0) {
      pins_[static_cast<std::size_t>(numbers[i])].particles.push_back(static_cast<PetscInt>(i));
      pinned_[i] = true;
    }
  }
}

std::vector<PetscInt> Pins::numbers() const {
  std::vector<PetscInt> result(pinned_.size(), -1);
  for (std::size_t pin = 0; pin < pins_.size(); ++pin) {
    for (const PetscInt i : pins_[pin].particles) {
      result[static_cast<std::size_t>(i)] = static_cast<PetscInt>(pin);
    }
  }
  return result;
}

void Pins::impose(Field& positions, double time) const {
  for (const Pin& pin : pins_) {
    const Eigen::Vector3d displacement = place_of_motion(pin.path, pin.velocity, time);
    for (const PetscInt i : pin.particles) {
      positions.vector(i) = points_->rest.col(i) + displacement;
    }
  }
}

}  // namespace pellicle
