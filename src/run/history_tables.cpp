#include "run/history_tables.h"

#include <cstdio>

namespace pellicle::run {

namespace {

/// "history_cloth.csv" of "history".
std::string file_of(const std::string& table, const Object& object) {
  return table + (object.name().empty() ? "" : "_" + object.name()) + ".csv";
}

}  // namespace

HistoryTables::HistoryTables(OutputFolder& folder, Object& object, bool contact_apart)
    : object_(object),
      contact_apart_(contact_apart),
      history_(folder, file_of("history", object), object.report(0, contact_apart).columns(), key_of(object.name())) {
  if (object.state().burning) {
    pieces_ = std::make_unique<History>(
        folder, file_of("pieces", object),
        std::vector<History::Column>{{"time", "s"}, {"step", ""}, {"piece", ""}, {"birth_time", "s"}, {"mass", "kg"}},
        key_of(object.name()));
  }
  if (object.options().project.monitor) {
    std::vector<History::Column> columns{
        {"time", "s"}, {"step", ""}, {"projection_step", ""}, {"projected_colour", ""}};
    for (const char* colour : colour_names) {
      columns.push_back({std::string("error_") + colour, "m"});
    }
    columns.push_back({"error_total", "m"});
    projection_ = std::make_unique<History>(folder, file_of("projection", object), columns, key_of(object.name()));
  }
}

void HistoryTables::add_step(int retries) {
  const State& state = object_.state();
  if (projection_ != nullptr) {
    projection_->start();
    for (const ProjectionError& error : object_.last_step().projected) {  // the curves of Fig. 8
      if (rank_of(object_.surface().comm()) == 0) {
        const char* after = error.projected ? colour_names[static_cast<std::size_t>(*error.projected)] : "start";
        std::printf("  projection step %d %-6s ||C|| red %.4e green %.4e blue %.4e yellow %.4e all %.4e\n", error.step,
                    after, error.colour[0], error.colour[1], error.colour[2], error.colour[3], error.total);
      }
      std::vector<double> row{state.time, static_cast<double>(state.step), static_cast<double>(error.step),
                              error.projected ? static_cast<double>(*error.projected) : -1.0};
      row.insert(row.end(), error.colour.begin(), error.colour.end());
      row.push_back(error.total);
      projection_->add(row);
    }
  }
  if (pieces_ != nullptr) {
    pieces_->start();  // It is there, too, when nothing is left.
  }
  history_.add(object_.report(retries, contact_apart_).values());
}

void HistoryTables::add_frame() {
  if (pieces_ == nullptr) {
    return;
  }
  const State& state = object_.state();
  const Pieces& pieces = state.burning->pieces;
  const std::vector<double> masses = piece_masses(pieces, object_.surface(), state.burning->mass);
  for (std::size_t i = 0; i < masses.size(); ++i) {
    pieces_->add({state.time, static_cast<double>(state.step), static_cast<double>(pieces.present[i]),
                  pieces.birth_time[i], masses[i]});
  }
}

void HistoryTables::save(Hdf5File& checkpoint) const {
  history_.save(checkpoint);
  for (const History* table : {pieces_.get(), projection_.get()}) {
    if (table != nullptr) {
      table->save(checkpoint);
    }
  }
}

void HistoryTables::resume(const Hdf5File& checkpoint) {
  history_.resume(checkpoint);
  for (History* table : {pieces_.get(), projection_.get()}) {
    if (table != nullptr) {
      table->resume(checkpoint);
    }
  }
}

}  // namespace pellicle::run
