#include "io/history.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "base/error.h"

namespace pellicle {

History::History(MPI_Comm comm, std::string path, const std::vector<Column>& columns)
    : comm_(comm), path_(std::move(path)), columns_(columns.size()) {
  std::string names;
  for (const Column& column : columns) {
    names += (names.empty() ? "" : ",") + column.name + (column.unit.empty() ? "" : " [" + column.unit + "]");
  }
  on_root(comm_, [&] {
    std::error_code ignored;  // Opening the file tells what is wrong.
    std::filesystem::create_directories(std::filesystem::path(path_).parent_path(), ignored);
    file_.open(path_);
    write_line(names);
  });
}

void History::add(const std::vector<double>& values) {
  if (values.size() != columns_) {
    throw std::logic_error(path_ + ": a row of " + std::to_string(values.size()) + " values for " +
                           std::to_string(columns_) + " columns");
  }
  on_root(comm_, [&] {
    std::string line;
    for (const double value : values) {
      char text[32];
      std::snprintf(text, sizeof text, "%.17g", value);
      line += (line.empty() ? "" : ",") + std::string(text);
    }
    write_line(line);
  });
}

void History::write_line(const std::string& line) {
  file_ << line << '\n' << std::flush;
  if (!file_) {
    throw Error(path_ + ": cannot be written: " + std::strerror(errno));
  }
}

}  // namespace pellicle
