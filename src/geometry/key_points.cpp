#include "geometry/key_points.h"

#include <fmt/format.h>

#include <algorithm>

namespace pellicle::geometry {

namespace {

/// The value `of` rows at `time`, linear between two rows and constant before the first and after the last.
template <class Of>
auto interpolated(const std::vector<std::vector<double>>& rows, double time, const Of& of) {
  const auto next = std::upper_bound(rows.begin(), rows.end(), time,
                                     [](double t, const std::vector<double>& row) { return t < row[0]; });
  if (next == rows.begin() || next == rows.end()) {
    return of(next == rows.begin() ? rows.front() : rows.back());
  }
  const std::vector<double>& before = *(next - 1);
  const double fraction = (time - before[0]) / ((*next)[0] - before[0]);
  return decltype(of(before))((1 - fraction) * of(before) + fraction * of(*next));
}

}  // namespace

Eigen::Vector3d place_on_key_points(const std::vector<std::vector<double>>& rows, double time) {
  return interpolated(rows, time,
                      [](const std::vector<double>& row) { return Eigen::Vector3d(row[1], row[2], row[3]); });
}

Eigen::Vector3d integral_on_key_points(const std::vector<std::vector<double>>& rows, double time) {
  // From the first row: linear pieces, by the trapezoidal rule.
  const auto from_first = [&rows](double end) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double before = rows.front()[0];
    const auto add = [&](double after) {
      sum += (after - before) / 2 * (place_on_key_points(rows, before) + place_on_key_points(rows, after));
      before = after;
    };
    for (const std::vector<double>& row : rows) {
      if (row[0] < end) {
        add(row[0]);
      }
    }
    add(end);
    return sum;
  };
  return from_first(time) - from_first(0);
}

double value_on_key_points(const std::vector<std::vector<double>>& rows, double time) {
  return interpolated(rows, time, [](const std::vector<double>& row) { return row[1]; });
}

std::string fault_of_key_points(const std::vector<std::vector<double>>& rows, const std::vector<std::string>& columns) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string name = "key point " + std::to_string(i + 1);
    if (rows[i].size() != columns.size()) {
      return fmt::format("{} has {} numbers, expected {}: {}", name, rows[i].size(), columns.size(),
                         fmt::join(columns, ", "));
    }
    if (i > 0 && !(rows[i][0] > rows[i - 1][0])) {
      return name + " is at " + std::to_string(rows[i][0]) + " s, expected later than the one before";
    }
  }
  return "";
}

std::string fault_of_motion(const std::vector<std::vector<double>>& path, const Eigen::Vector3d& velocity,
                            const char* path_key, const char* velocity_key) {
  if (const std::string fault = fault_of_key_points(path); !fault.empty()) {
    return fmt::format(".{}: {}", path_key, fault);
  }
  const bool are_both_given = !path.empty() && !velocity.isZero(0);
  return are_both_given ? fmt::format(": both {} and {} given, expected one of them", path_key, velocity_key) : "";
}

Eigen::Vector3d place_of_motion(const std::vector<std::vector<double>>& path, const Eigen::Vector3d& velocity,
                                double time) {
  return path.empty() ? Eigen::Vector3d(velocity * time) : place_on_key_points(path, time);
}

}  // namespace pellicle::geometry
