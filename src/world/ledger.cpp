#include "world/ledger.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "ablation/ablation.h"
#include "ablation/cut_surface.h"
#include "heat/heat_balance.h"
#include "parallel/collective.h"

namespace pellicle {
inline namespace world {

namespace {

/// Table in a checkpoint, in the group of the object: FireRecord.
const char* const fire_table = "/fire";

std::vector<History::Column> burning_columns() {
  return {{"mass_left", "kg"}, {"mass_burnt", "kg"}, {"pieces", ""},     {"heat_content", "J"},
          {"heat_in", "J"},    {"heat_out", "J"},    {"heat_made", "J"}, {"temperature_max", "K"}};
}

/// Their values. Collective. @param capacity c [J/(kg K)] @param loss_mass m^loss as a share of m^init
std::vector<double> burning_values(const Surface& surface, const BurningFields& fields, double capacity,
                                   double loss_mass) {
  double mass = 0;
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    mass += fields.mass.data()[i];
  }
  std::array<double, 6> sums{
      mass,           fields.mass_burnt, heat_content(surface, fields.mass, fields.temperature, capacity),
      fields.heat_in, fields.heat_out,   fields.heat_made};
  sums = sum_over_ranks(surface.comm(), sums);
  const double hottest =
      largest_drawn(surface, fields.living, level_set(surface, fields.mass, loss_mass), fields.temperature.data());
  const auto pieces = static_cast<double>(fields.pieces.present.size());
  return {sums[0], sums[1], pieces, sums[2], sums[3], sums[4], sums[5], hottest};
}

/// Kinetic energy [J] and momentum [kg m/s]. Collective. @param mass of the owned particles [kg]
std::array<double, 4> motion(const Surface& surface, const double* mass, const Field& velocity) {
  std::array<double, 4> sums{};
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    const Eigen::Vector3d v = velocity.vector(i);
    sums[0] += mass[i] * v.squaredNorm() / 2;
    Eigen::Map<Eigen::Vector3d>(sums.data() + 1) += mass[i] * v;
  }
  sums = sum_over_ranks(surface.comm(), sums);
  return sums;
}

template <class Values>
void append(Values& values, const Values& more) {
  values.insert(values.end(), more.begin(), more.end());
}

}  // namespace

std::string crack_line(const std::array<double, 2>& cracks) {
  return fmt::format("cracks: {:.0f} sides of cells, {:.4g} m", cracks[0], cracks[1]);
}

std::vector<History::Column> body_columns(const std::vector<std::string>& names) {
  std::vector<History::Column> columns;
  for (const std::string& name : names) {
    for (const char* axis : {"_x", "_y", "_z"}) {
      columns.push_back({"force_" + name + axis, "N", "bodies." + name});
    }
    columns.push_back({"gap_" + name, "m", "bodies." + name});
  }
  return columns;
}

std::vector<double> body_values(std::size_t bodies, const std::vector<BodyLoad>& loads) {
  std::vector<double> values(4 * bodies, 0);
  for (std::size_t b = 0; b < loads.size(); ++b) {
    Eigen::Map<Eigen::Vector4d>(values.data() + 4 * b) << loads[b].force, loads[b].gap;
  }
  return values;
}

Ledger::Ledger(const ObjectOutput& output, bool burns, const std::vector<History::Column>& own)
    : clock_(output.clock), group_(output.group("fire")) {
  std::vector<History::Column> columns{{"time", "s"}, {"step", ""}, {"time_step", "s"}, {"retries", ""}};
  if (burns) {
    append(columns, burning_columns());
    pieces_ = std::make_unique<History>(
        output.folder, output.table("pieces"),
        std::vector<History::Column>{{"time", "s"}, {"step", ""}, {"piece", ""}, {"birth_time", "s"}, {"mass", "kg"}},
        key_of(output.object));
  }
  append(columns,
         {{"kinetic_energy", "J"}, {"momentum_x", "kg m/s"}, {"momentum_y", "kg m/s"}, {"momentum_z", "kg m/s"}});
  append(columns, own);
  for (const StageTime& stage : clock_.stages()) {
    std::string name = "seconds_" + stage.name;
    std::replace(name.begin(), name.end(), ' ', '_');
    columns.push_back({name, "s"});
  }
  history_ = std::make_unique<History>(output.folder, output.table("history"), columns, key_of(output.object));
}

void Ledger::resume(const Hdf5File& checkpoint) {
  history_->resume(checkpoint);
  if (pieces_ != nullptr) {
    pieces_->resume(checkpoint);
    const std::vector<double> fire = checkpoint.read_all<double>(group_ + fire_table);
    fire_ = {fire.at(0), fire.at(1), fire.at(2), fire.at(3)};
  }
}

void Ledger::save(Hdf5File& checkpoint) const {
  history_->save(checkpoint);
  if (pieces_ != nullptr) {
    pieces_->save(checkpoint);
    const std::array<double, 4> fire = fire_.numbers();
    checkpoint.write_once<double>(group_ + fire_table, {fire.begin(), fire.end()});
  }
}

void Ledger::add(const LedgerRow& row, const std::vector<double>& own) {
  std::vector<double> values{row.state.time, static_cast<double>(row.state.step), row.h,
                             static_cast<double>(row.retries)};
  if (row.burning != nullptr) {
    const std::vector<double> burning = burning_values(row.surface, *row.burning, row.capacity, row.loss_mass);
    append(values, burning);
    fire_.note(row.state.time, burning[0], burning[1], burning[7]);
  }
  for (const double value : motion(row.surface, row.mass, row.state.velocity)) {
    values.push_back(value);
  }
  append(values, own);
  if (pieces_ != nullptr) {
    pieces_->start();  // It is there, too, when nothing is left.
  }
  for (const StageTime& stage : clock_.stages()) {
    values.push_back(stage.lap_seconds);
  }
  history_->add(values);
}

void Ledger::add_pieces(double time, int step, const Pieces& pieces, const std::vector<double>& masses) {
  for (std::size_t i = 0; i < masses.size(); ++i) {
    pieces_->add(
        {time, static_cast<double>(step), static_cast<double>(pieces.present[i]), pieces.birth_time[i], masses[i]});
  }
}

}  // namespace world
}  // namespace pellicle
