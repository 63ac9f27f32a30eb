#pragma once

#include <mpi.h>

#include <fstream>
#include <string>
#include <vector>

namespace pellicle {

/// A table of numbers over time in a CSV file, which grows by a row a step and can be read at any moment.
class History {
 public:
  struct Column {
    std::string name;
    std::string unit;  ///< SI, as in "kg"; empty for a pure number
  };

  /// Makes the file, its folder too, and writes the line of names: `time [s],step,mass_left [kg]`. A file of that name
  /// is replaced. Collective. @throws Error, on all ranks, if that fails.
  History(MPI_Comm comm, std::string path, const std::vector<Column>& columns);

  /// Adds a row, one value a column in their order, with all digits. The values of rank 0 count. Collective.
  /// @throws Error, on all ranks, when the file cannot be written; std::logic_error on a wrong number of values.
  void add(const std::vector<double>& values);

 private:
  void write_line(const std::string& line);

  MPI_Comm comm_;
  std::string path_;
  std::size_t columns_;
  std::ofstream file_;  ///< open on rank 0 only
};

}  // namespace pellicle
