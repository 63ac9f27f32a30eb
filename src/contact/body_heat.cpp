#include "contact/body_heat.h"

#include <algorithm>
#include <cmath>

namespace pellicle {
inline namespace contact {

bool exchange_heat(const std::map<std::string, BodyOptions>& bodies) {
  return std::any_of(bodies.begin(), bodies.end(),
                     [](const auto& body) { return body.second.temperature.has_value(); });
}

BodyHeat exchange_with_bodies(Field& temperature, const std::vector<Body>& bodies, const BodyHeatInput& input) {
  BodyHeat heat;
  for (const Body& body : bodies) {
    if (!body.temperature) {
      continue;
    }
    const Solid solid = body.at(input.time);
    for (PetscInt i = 0; i < input.particles.owned; ++i) {
      const double capacity = input.mass.data()[i] * input.capacity;
      if (capacity <= 0 || signed_distance(solid, input.positions.vector(i)).distance - body.margin > input.reach) {
        continue;
      }
      double& value = temperature.data()[i];
      const double share = -std::expm1(-body.heat_transfer * input.area[i] * input.h / capacity);
      const double change = share * (*body.temperature - value);
      value += change;
      heat.gained += capacity * std::max(change, 0.0);
      heat.lost += capacity * std::max(-change, 0.0);
    }
  }
  temperature.update_ghosts();
  return heat;
}

}  // namespace contact
}  // namespace pellicle
