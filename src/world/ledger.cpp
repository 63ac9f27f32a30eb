#include "world/ledger.h"

#include <algorithm>
#include <cmath>

namespace pellicle {

std::vector<double> strains(const SpringSet& springs, const State& state, Colour colour) {
  const std::vector<double>& target = state.target_length[static_cast<std::size_t>(colour)];
  std::vector<double> result(springs.ends.size());
  for (std::size_t s = 0; s < springs.ends.size(); ++s) {
    const auto& [a, b] = springs.ends[s];
    if (!state.living.springs[static_cast<std::size_t>(colour)][s]) {
      continue;
    }
    result[s] = (state.position.vector(a) - state.position.vector(b)).norm() / target[s] - 1;
  }
  return result;
}

Ledger::Ledger(const ObjectOutput& output, const Options& options, const Hdf5File* resumed)
    : comm_(output.folder.comm()), options_(options), clock_(output.clock) {
  std::vector<History::Column> columns{{"time", "s"}, {"step", ""}, {"time_step", "s"}, {"retries", ""}};
  columns.insert(columns.end(), burning_columns().begin(), burning_columns().end());
  columns.insert(columns.end(), {{"kinetic_energy", "J"},
                                 {"momentum_x", "kg m/s"},
                                 {"momentum_y", "kg m/s"},
                                 {"momentum_z", "kg m/s"},
                                 {"constraint_error", "m"},
                                 {"contacts", ""},
                                 {"heat_iterations", ""},
                                 {"projection_iterations", ""}});
  for (const char* colour : colour_names) {
    columns.push_back({std::string("strain_max_") + colour, ""});
    columns.push_back({std::string("strain_rms_") + colour, ""});
  }
  for (const StageTime& stage : clock_.stages()) {
    std::string name = "seconds_" + stage.name;
    std::replace(name.begin(), name.end(), ' ', '_');
    columns.push_back({name, "s"});
  }
  history_ = std::make_unique<History>(output.folder, output.table("history"), columns, resumed);
  pieces_ = std::make_unique<PieceTable>(output, resumed);
  if (options.project.monitor) {
    projection_ = std::make_unique<History>(output.folder, output.table("projection"),
                                            std::vector<History::Column>{{"time", "s"},
                                                                         {"step", ""},
                                                                         {"projection_step", ""},
                                                                         {"projected_colour", ""},
                                                                         {"error_red", "m"},
                                                                         {"error_green", "m"},
                                                                         {"error_blue", "m"},
                                                                         {"error_yellow", "m"},
                                                                         {"error_total", "m"}},
                                            resumed);
  }
}

void Ledger::save(Hdf5File& checkpoint) const {
  history_->save(checkpoint);
  pieces_->save(checkpoint);
  if (projection_ != nullptr) {
    projection_->save(checkpoint);
  }
}

void Ledger::add(const Sheet& sheet, const State& state, const BurnStep& step, double h, int retries) {
  // Sums over the owned particles and springs, then over the ranks.
  enum Sum {
    kinetic,
    momentum,
    contacts = momentum + 3,
    strain,
    springs = strain + 4,  // that live
    count = springs + 4
  };
  std::array<double, count> sums{};
  std::array<double, 4> maxima{};  // strain of each colour
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    const double m = state.mass.values()(0, i);
    const Eigen::Vector3d v = state.velocity.vector(i);
    sums[kinetic] += m * v.squaredNorm() / 2;
    Eigen::Map<Eigen::Vector3d>(sums.data() + momentum) += m * v;
  }
  sums[contacts] = static_cast<double>(step.contacts);
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    const std::vector<double> all = strains(sheet.of(colour), state, colour);
    for (PetscInt s = 0; s < sheet.of(colour).owned(); ++s) {
      const double value = std::abs(all[static_cast<std::size_t>(s)]);
      sums[strain + index] += value * value;
      sums[springs + index] += state.living.springs[index][static_cast<std::size_t>(s)] ? 1 : 0;
      maxima[index] = std::max(maxima[index], value);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), count, MPI_DOUBLE, MPI_SUM, comm_);
  MPI_Allreduce(MPI_IN_PLACE, maxima.data(), 4, MPI_DOUBLE, MPI_MAX, comm_);

  std::vector<double> row{state.time, static_cast<double>(state.step), h, static_cast<double>(retries)};
  const std::vector<double> burning = burning_row(sheet, state, options_.heat.capacity);
  row.insert(row.end(), burning.begin(), burning.end());
  row.insert(row.end(), {sums[kinetic], sums[momentum], sums[momentum + 1], sums[momentum + 2], step.constraint_error,
                         sums[contacts], static_cast<double>(step.heat_iterations),
                         static_cast<double>(step.dynamics_iterations)});
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    row.push_back(maxima[index]);
    row.push_back(std::sqrt(sums[strain + index] / std::max(1.0, sums[springs + index])));
  }
  for (const StageTime& stage : clock_.stages()) {
    row.push_back(stage.lap_seconds);
  }
  history_->add(row);
}

void Ledger::add(double time, int step, const std::vector<ProjectionError>& errors) {
  if (projection_ == nullptr) {
    return;
  }
  for (const ProjectionError& error : errors) {
    std::vector<double> row{time, static_cast<double>(step), static_cast<double>(error.step),
                            error.projected ? static_cast<double>(*error.projected) : -1.0};
    row.insert(row.end(), error.colour.begin(), error.colour.end());
    row.push_back(error.total);
    projection_->add(row);
  }
}

}  // namespace pellicle
