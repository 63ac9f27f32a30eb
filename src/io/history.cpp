#include "io/history.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/error.h"
#include "base/units.h"
#include "options/spelling.h"

namespace pellicle::io {

namespace {

constexpr int new_file = O_RDWR | O_CREAT | O_EXCL;

/// Name of the number of bytes of a file in a checkpoint.
std::string table_of(const std::string& file) { return "output/tables/" + file; }

[[noreturn]] void refuse(const std::string& path) {
  throw Error(path +
              ": is not the table that the run had written when its state was kept; expected the output folder as the "
              "run left it, or another one for what follows (-output_directory)");
}

}  // namespace

void keep_tables(OutputFolder& folder, const Hdf5File& checkpoint) {
  const std::vector<std::string> names = checkpoint.names("output/tables");
  for (const std::string& name : names) {
    const auto bytes = static_cast<long long>(checkpoint.read_all<double>(table_of(name)).front());
    on_root(folder.comm(), [&] {
      const OpenFile file(folder.path(name), O_RDONLY);
      if (!file.is_open() || file.size() < bytes) {
        refuse(file.path());
      }
    });
  }
  folder.keep([names](const std::string& file) { return std::find(names.begin(), names.end(), file) != names.end(); });
}

History::History(OutputFolder& folder, std::string name, std::vector<Column> columns, const std::string& owner)
    : folder_(folder), name_(std::move(name)), columns_(std::move(columns)) {
  folder_.reserve(name_, owner);
  DistinctNames distinct("column", " of " + name_);
  for (const Column& column : columns_) {
    distinct.add(column.name, column.owner);
  }
}

/// The first line of the file: the names of the columns with their units.
std::string History::head() const {
  std::string line;
  for (const Column& column : columns_) {
    line += (line.empty() ? "" : ",") + column.name + (column.unit.empty() ? "" : " [" + column.unit + "]");
  }
  return line + "\n";
}

void History::start() {
  if (is_started_) {
    return;
  }
  folder_.start();
  on_root(folder_.comm(), [&] {
    folder_.list({name_});
    file_ = OpenFile(folder_.path(name_), new_file);
    file_.append(head());
  });
  is_started_ = true;
}

void History::resume(const Hdf5File& checkpoint) {
  if (!checkpoint.has(table_of(name_))) {
    start();
    return;
  }
  const auto kept = static_cast<long long>(checkpoint.read_all<double>(table_of(name_)).front());  // bytes
  folder_.start();
  on_root(folder_.comm(), [&] {
    folder_.list({name_});
    file_ = OpenFile(folder_.path(name_), O_RDWR);
    const std::string line = head();
    if (!file_.is_open() || !starts_with(file_.text(), line)) {
      refuse(file_.path());
    }
    file_.truncate(kept);
  });
  is_started_ = true;
}

void History::save(Hdf5File& checkpoint) const {
  std::vector<double> bytes;
  on_root(folder_.comm(), [&] { bytes.push_back(static_cast<double>(file_.size())); });
  checkpoint.write_once(table_of(name_), bytes);
}

void History::add(const std::vector<double>& values) {
  if (values.size() != columns_.size()) {
    throw std::logic_error(name_ + ": a row of " + std::to_string(values.size()) + " values for " +
                           std::to_string(columns_.size()) + " columns");
  }
  start();
  on_root(folder_.comm(), [&] {
    const auto odd = std::find_if_not(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
    if (odd != values.end()) {
      throw Error(name_ + ": " + columns_[odd - values.begin()].name + " is " + number_text(*odd) +
                  ", expected a finite number: some option is beyond what can be computed with");
    }
    file_.append(fmt::format("{:.17g}\n", fmt::join(values, ",")));
    require_present();
  });
}

void History::require_present() {
  if (file_.is_at(file_.path())) {
    return;
  }
  std::string fault = file_.path() + " was removed or replaced while the run went on";
  try {
    folder_.require_present();
  } catch (const Error& error) {
    fault = error.what();
  }
  OpenFile again(folder_.path(name_), new_file);
  if (!again.is_open()) {
    again = OpenFile(folder_.path("rescued_" + name_), new_file);
  }
  again.append(file_.text());
  file_ = std::move(again);
  folder_.list({"rescued_" + name_});
  throw Error(fault + "; its rows are in " + file_.path());
}

}  // namespace pellicle::io
