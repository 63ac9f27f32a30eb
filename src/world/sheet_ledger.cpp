#include "world/sheet_ledger.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "io/console.h"
#include "parallel/collective.h"
#include "world/contact_of_object.h"
#include "world/gas_of_object.h"

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

// Tables in a checkpoint, in the group of the object: the largest strain so far, its place and time.
const char* const record_table = "/largest_strain";

std::vector<std::string> names_of_bodies(const Options& options) {
  std::vector<std::string> names;
  for (const auto& body : options.bodies) {
    names.push_back(body.first);
  }
  return names;
}

std::vector<History::Column> columns_of_sheet(const ObjectOutput& output, const Chambers& chambers,
                                              const Options& options) {
  std::vector<History::Column> columns{
      {"constraint_error", "m"}, {"contacts", ""}, {"heat_iterations", ""}, {"projection_iterations", ""}};
  for (const char* colour : colour_names) {
    columns.push_back({std::string("strain_max_") + colour, ""});
    columns.push_back({std::string("strain_rms_") + colour, ""});
  }
  for (const char* name : {"largest_strain", "largest_strain_id_1", "largest_strain_id_2"}) {
    columns.push_back({name, ""});
  }
  for (const char* name : {"largest_strain_x", "largest_strain_y", "largest_strain_z"}) {
    columns.push_back({name, "m"});
  }
  columns.push_back({"mean_strain", ""});
  columns.push_back({"newton_iterations", ""});
  columns.push_back({"force_residual", ""});
  if (options.ablation.strength) {
    columns.push_back({"cracked_sides", ""});
    columns.push_back({"crack_length", "m"});
  }
  if (options.dynamics != Dynamics::projection) {
    columns.push_back({"elastic_energy", "J"});
  }
  const std::vector<History::Column> of_work = work_columns(options);
  columns.insert(columns.end(), of_work.begin(), of_work.end());
  const std::vector<History::Column> of_contact = contact_columns(options.contact, output.contact_apart);
  columns.insert(columns.end(), of_contact.begin(), of_contact.end());
  if (chambers.count() > 0) {
    const std::vector<History::Column> of_gas = gas_columns(chambers);
    columns.insert(columns.end(), of_gas.begin(), of_gas.end());
  }
  const std::vector<History::Column> of_bodies = body_columns(names_of_bodies(options));
  columns.insert(columns.end(), of_bodies.begin(), of_bodies.end());
  return columns;
}

}  // namespace

SheetLedger::SheetLedger(const ObjectOutput& output, const Options& options, const Chambers& chambers)
    : options_(options),
      contact_apart_(output.contact_apart),
      group_(output.group("sheet")),
      ledger_(output, true, columns_of_sheet(output, chambers, options)) {
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
                                            key_of(output.object));
  }
}

void SheetLedger::resume(const Hdf5File& checkpoint) {
  const std::vector<double> record = checkpoint.read_all<double>(group_ + record_table);
  record_ = {record.at(0), {record.at(1), record.at(2), record.at(3)}, record.at(4)};
  ledger_.resume(checkpoint);
  if (projection_ != nullptr) {
    projection_->resume(checkpoint);
  }
}

void SheetLedger::save(Hdf5File& checkpoint) const {
  ledger_.save(checkpoint);
  checkpoint.write_once<double>(group_ + record_table,
                                {record_.strain, record_.place[0], record_.place[1], record_.place[2], record_.time});
  if (projection_ != nullptr) {
    projection_->save(checkpoint);
  }
}

void SheetLedger::add(const Sheet& sheet, const State& state, const Burn& burn, const BurnStep& step, double h,
                      int retries) {
  if (projection_ != nullptr) {
    projection_->start();
  }
  PetscInt contacts = step.contacts;
  contacts = sum_over_ranks(sheet.comm(), contacts);
  const NetStrain net = burn.net_strain(state);
  std::vector<double> own{step.constraint_error, static_cast<double>(contacts),
                          static_cast<double>(step.heat_iterations), static_cast<double>(step.dynamics_iterations)};
  for (std::size_t colour = 0; colour < 4; ++colour) {
    own.push_back(net.largest_of[colour]);
    own.push_back(net.rms_of[colour]);
  }
  own.insert(own.end(),
             {net.largest, static_cast<double>(net.ids[0]), static_cast<double>(net.ids[1]), net.place[0], net.place[1],
              net.place[2], net.mean, static_cast<double>(step.newton_iterations), step.force_residual});
  if (h > 0 && net.largest > record_.strain) {
    record_ = {net.largest, net.place, state.time};
  }
  if (options_.ablation.strength) {
    cracks_ = {state.cracked_sides, state.crack_length};
    cracks_ = sum_over_ranks(sheet.comm(), cracks_);
    own.insert(own.end(), cracks_.begin(), cracks_.end());
  }
  if (options_.dynamics != Dynamics::projection) {
    own.push_back(step.elastic_energy);
  }
  const std::vector<double> of_work = work_values(options_, state.work);
  own.insert(own.end(), of_work.begin(), of_work.end());
  const std::vector<double> of_contact =
      contact_values(options_.contact, contact_apart_, step.touching, sheet, state, &state.living.triangles);
  own.insert(own.end(), of_contact.begin(), of_contact.end());
  if (burn.chambers().count() > 0) {
    const std::vector<double> of_gas = gas_values(burn.chambers(), state, state.pressure.data(), state.time);
    own.insert(own.end(), of_gas.begin(), of_gas.end());
  }
  const std::vector<double> of_bodies = body_values(options_.bodies.size(), step.loads);
  own.insert(own.end(), of_bodies.begin(), of_bodies.end());
  ledger_.add(
      {sheet, state, state.mass.data(), &state, options_.heat.capacity, options_.ablation.loss_mass, h, retries}, own);
}

std::vector<std::string> SheetLedger::remarks() const {
  std::vector<std::string> lines;
  if (record_.strain >= 0) {
    lines.push_back("largest strain of the net: " + words_of(record_.strain, record_.place) + ", " +
                    time_text(record_.time));
  }
  if (cracks_[0] > 0) {
    lines.push_back(crack_line(cracks_));
  }
  const std::vector<std::string> of_fire = ledger_.remarks(options_);
  lines.insert(lines.end(), of_fire.begin(), of_fire.end());
  return lines;
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
