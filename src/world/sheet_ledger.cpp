#include "world/sheet_ledger.h"

#include <algorithm>
#include <cmath>

namespace pellicle {
inline namespace world {

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

namespace {

std::vector<History::Column> columns_of_sheet() {
  std::vector<History::Column> columns{
      {"constraint_error", "m"}, {"contacts", ""}, {"heat_iterations", ""}, {"projection_iterations", ""}};
  for (const char* colour : colour_names) {
    columns.push_back({std::string("strain_max_") + colour, ""});
    columns.push_back({std::string("strain_rms_") + colour, ""});
  }
  return columns;
}

}  // namespace

SheetLedger::SheetLedger(const ObjectOutput& output, const Options& options, const Hdf5File* resumed)
    : options_(options), ledger_(output, true, columns_of_sheet(), resumed) {
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

void SheetLedger::save(Hdf5File& checkpoint) const {
  ledger_.save(checkpoint);
  if (projection_ != nullptr) {
    projection_->save(checkpoint);
  }
}

void SheetLedger::add(const Sheet& sheet, const State& state, const BurnStep& step, double h, int retries) {
  // Sums over the owned springs, then over the ranks.
  enum Sum {
    contacts,
    strain,
    springs = strain + 4,  // that live
    count = springs + 4
  };
  std::array<double, count> sums{};
  std::array<double, 4> maxima{};  // strain of each colour
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
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), count, MPI_DOUBLE, MPI_SUM, sheet.comm());
  MPI_Allreduce(MPI_IN_PLACE, maxima.data(), 4, MPI_DOUBLE, MPI_MAX, sheet.comm());

  std::vector<double> own{step.constraint_error, sums[contacts], static_cast<double>(step.heat_iterations),
                          static_cast<double>(step.dynamics_iterations)};
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    own.push_back(maxima[index]);
    own.push_back(std::sqrt(sums[strain + index] / std::max(1.0, sums[springs + index])));
  }
  ledger_.add({sheet, state, state.mass.data(), &state, options_.heat.capacity, h, retries}, own);
}

void SheetLedger::add(double time, int step, const std::vector<ProjectionError>& errors) {
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

}  // namespace world
}  // namespace pellicle
