#include "world/work.h"

#include <array>

#include "parallel/collective.h"
#include "world/stage.h"

namespace pellicle {
inline namespace world {

namespace {

struct KindOfWork {
  const char* column;
  bool applies;
};

/// In the order of Work.
std::array<KindOfWork, kinds_of_work> kinds_of(const Options& options) {
  return {{{"gravity_work", true},
           {"damping_work", true},
           {"pin_work", !options.pins.empty()},
           {"pressure_work", !options.chambers.empty()},
           {"body_work", !options.bodies.empty() && balances_bodies(options)},
           {"air_work", options.force.air.density > 0},
           {"load_work", !options.attachments.empty() || !options.forces.empty()}}};
}

}  // namespace

double kinetic_energy(const Surface& surface, const double* mass, const Field& velocity) {
  double sum = 0;
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    sum += mass[i] / 2 * velocity.vector(i).squaredNorm();
  }
  return sum_over_ranks(surface.comm(), sum);
}

void report_work(Report& report, const Options& options, const Eigen::VectorXd& works) {
  Eigen::Index kind = 0;
  for (const auto& [column, applies] : kinds_of(options)) {
    if (applies) {
      report.add(column, "J", works[kind]);
    }
    ++kind;
  }
}

}  // namespace world
}  // namespace pellicle
