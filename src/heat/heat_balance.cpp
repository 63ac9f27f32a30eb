#include "heat/heat_balance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "surface/drawn_surface.h"

namespace pellicle::heat {

double heat_content(const Surface& surface, const Field& mass, const Field& temperature, double capacity) {
  // The ledger compares sums over the whole surface with the heat that came in, which may be a small part of them.
  long double sum = 0;
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    sum += static_cast<long double>(mass.data()[i]) * temperature.data()[i];
  }
  return static_cast<double>(capacity * sum);
}

double apply_heat_source(Field& temperature, const HeatSource& source, const HeatSourceInput& input) {
  if (input.time < source.start_time || (source.end_time && input.time >= *source.end_time)) {
    return 0;
  }
  const Eigen::Vector3d centre = source.centre_at(input.time);
  const auto fraction = [&](PetscInt i) {
    if (source.shape == SourceShape::texture) {
      return -std::expm1(-source.rate * input.texture[i] * input.time_step);
    }
    const Eigen::Vector3d offset = input.positions.vector(i) - centre;
    const double squared = offset.squaredNorm() / (source.radius * source.radius);
    return squared < 1 ? -std::expm1(-source.rate * input.time_step) * (1 - squared) * (1 - squared) : 0;
  };
  double heat = 0;
  for (PetscInt i = 0; i < input.surface.particles.local(); ++i) {
    if (input.mass.data()[i] == 0) {
      continue;
    }
    double& value = temperature.data()[i];
    const double before = value;
    value += fraction(i) * std::max(source.temperature - value, 0.0);
    if (i < input.surface.particles.owned) {
      heat += input.mass.data()[i] * input.capacity * (value - before);
    }
  }
  return heat;
}

double release_burning_heat(Field& temperature, const Surface& surface, const Field& mass_change, const Field& mass,
                            const HeatOptions& options) {
  double heat = 0;
  for (PetscInt i = 0; i < surface.particles.local(); ++i) {
    if (mass.data()[i] == 0) {
      continue;
    }
    const double before = temperature.data()[i];
    const double after = before - options.burning_heat * mass_change.data()[i] / surface.initial_mass[i];
    temperature.data()[i] = after;
    if (i < surface.particles.owned) {
      heat += mass.data()[i] * options.capacity * (after - before);
    }
  }
  return heat;
}

Eigen::VectorXd particle_areas(const Surface& surface, const Field& positions, const ActiveSet& active) {
  Eigen::VectorXd area = Eigen::VectorXd::Zero(surface.particles.local());
  const std::array<double, 3> fraction = surface.point_shares();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (!active.triangles[t]) {
      continue;
    }
    const double triangle_area = element_area_vector(surface, positions.data(), surface.element_of_triangle(t)).norm() /
                                 surface.triangles_per_element;
    for (std::size_t i = 0; i < 3; ++i) {
      area[surface.triangles[t][i]] += fraction[i] * triangle_area;
    }
  }
  return area.head(surface.particles.owned);
}

HeatExchange exchange_with_surroundings(Field& temperature, const Surface& surface, const Field& positions,
                                        const Field& mass, const ActiveSet& active, double time_step,
                                        const HeatOptions& options) {
  HeatExchange exchange;
  if (options.convection == 0 && options.emissivity == 0) {
    return exchange;
  }
  const Eigen::VectorXd area = particle_areas(surface, positions, active);
  const double ambient = options.ambient_temperature;
  constexpr double stefan_boltzmann = 5.670374419e-8;  // [W/(m^2 K^4)]
  // Heat transfer coefficient of convection, and of radiation in the same form:
  // T^4 - A^4 = (T - A) (T + A) (T^2 + A^2).
  const auto transfer = [&](double value) {
    return options.convection +
           options.emissivity * stefan_boltzmann * (value + ambient) * (value * value + ambient * ambient);
  };
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    const double capacity = mass.data()[i] * options.capacity;
    if (capacity <= 0) {
      continue;
    }
    double& value = temperature.data()[i];
    const auto decayed = [&](double coefficient, double time) {
      return ambient + (value - ambient) * std::exp(-2 * area[i] * coefficient * time / capacity);
    };
    const double midway = decayed(transfer(value), 0.5 * time_step);
    const double end = decayed(transfer(midway), time_step);
    exchange.gained += capacity * std::max(end - value, 0.0);
    exchange.lost += capacity * std::max(value - end, 0.0);
    value = end;
  }
  temperature.update_ghosts();
  return exchange;
}

}  // namespace pellicle::heat
