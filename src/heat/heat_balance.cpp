#include "heat/heat_balance.h"

#include <algorithm>
#include <cmath>

#include "geometry/quad_area.h"

namespace pellicle {

namespace {

constexpr double stefan_boltzmann = 5.670374419e-8;  // [W/(m^2 K^4)]

}  // namespace

double heat_content(const Sheet& sheet, const Field& mass, const Field& temperature, double capacity) {
  // The ledger compares sums over the whole sheet with what came in, which may be little of them.
  long double sum = 0;
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    sum += static_cast<long double>(mass.data()[i]) * temperature.data()[i];
  }
  return static_cast<double>(capacity * sum);
}

double release_burning_heat(Field& temperature, const Sheet& sheet, const Field& mass_change, const Field& mass,
                            const HeatOptions& options) {
  double heat = 0;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    if (mass.data()[i] == 0) {
      continue;
    }
    const double before = temperature.data()[i];
    const double after =
        before - options.burning_heat * mass_change.data()[i] / sheet.initial_mass[static_cast<std::size_t>(i)];
    temperature.data()[i] = after;
    if (i < sheet.particles.owned) {
      heat += mass.data()[i] * options.capacity * (after - before);
    }
  }
  return heat;
}

Eigen::VectorXd particle_areas(const Sheet& sheet, const Field& positions, const Living& living) {
  Eigen::VectorXd area = Eigen::VectorXd::Zero(sheet.particles.local());
  for (std::size_t c = 0; c < sheet.cells.size(); ++c) {
    const std::array<PetscInt, 4>& cell = sheet.cells[c];
    const double cell_area = quad_area_vector(positions.vector(cell[0]), positions.vector(cell[1]),
                                              positions.vector(cell[2]), positions.vector(cell[3]))
                                 .norm();
    for (std::size_t k = 0; k < 4; ++k) {
      if (living.triangles[4 * c + k]) {
        area[cell[k]] += cell_area / 16;
        area[cell[(k + 1) % 4]] += cell_area / 16;
        area[sheet.lattice[c]] += cell_area / 8;
      }
    }
  }
  return area.head(sheet.particles.owned);
}

HeatExchange exchange_with_surroundings(Field& temperature, const Sheet& sheet, const Field& positions,
                                        const Field& mass, const Living& living, double time_step,
                                        const HeatOptions& options) {
  HeatExchange exchange;
  if (options.convection == 0 && options.emissivity == 0) {
    return exchange;
  }
  const Eigen::VectorXd area = particle_areas(sheet, positions, living);
  const double ambient = options.ambient_temperature;
  // Heat transfer coefficient of convection and of radiation written as such: T^4 - A^4 = (T - A) (T + A) (T^2 + A^2).
  const auto transfer = [&](double value) {
    return options.convection +
           options.emissivity * stefan_boltzmann * (value + ambient) * (value * value + ambient * ambient);
  };
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
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

}  // namespace pellicle
