#include "world/work.h"

#include <array>

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

std::vector<History::Column> work_columns(const Options& options) {
  std::vector<History::Column> columns;
  for (const auto& [column, applies] : kinds_of(options)) {
    if (applies) {
      columns.push_back({column, "J"});
    }
  }
  return columns;
}

std::vector<double> work_values(const Options& options, const Eigen::VectorXd& works) {
  std::vector<double> values;
  Eigen::Index kind = 0;
  for (const auto& [column, applies] : kinds_of(options)) {
    if (applies) {
      values.push_back(works[kind]);
    }
    ++kind;
  }
  return values;
}

}  // namespace world
}  // namespace pellicle
