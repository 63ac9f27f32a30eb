#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/stage_clock.h"

namespace pellicle {

/// A row of a table by its columns' names, as a test works it out.
using TableRow = std::map<std::string, double>;

/// Adds the columns of seconds: rank 0's of the present lap. Collective.
inline void add_seconds(TableRow& row, const StageClock& clock) {
  for (const StageTime& stage : clock.stages()) {
    std::string name = "seconds_" + stage.name;
    std::replace(name.begin(), name.end(), ' ', '_');
    double seconds = stage.lap_seconds;
    MPI_Bcast(&seconds, 1, MPI_DOUBLE, 0, PETSC_COMM_WORLD);
    row[name] = seconds;
  }
}

/// Expects that a table has these rows, and no column that a row does not name.
/// @param rounding what values may differ by beside 1e-9 of themselves
/// @param rounding_of the same of columns that are small differences of large values, by name
inline void expect_table(const std::map<std::string, std::vector<double>>& table, const std::vector<TableRow>& rows,
                         double rounding, const TableRow& rounding_of = {}) {
  for (const auto& [name, column] : table) {
    ASSERT_EQ(column.size(), rows.size()) << name;
    ASSERT_EQ(rows[0].count(name), 1U) << name << " has no independent value in this test";
    const auto own = rounding_of.find(name);
    const double own_rounding = own != rounding_of.end() ? own->second : rounding;
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const double expected = rows[row].at(name);
      EXPECT_NEAR(column[row], expected, 1e-9 * std::abs(expected) + own_rounding) << name << ", row " << row;
    }
  }
  for (const auto& [name, value] : rows[0]) {
    EXPECT_EQ(table.count(name), 1U) << name << " is missing";
  }
}

}  // namespace pellicle
