#include "geometry/key_points.h"

#include <fmt/format.h>

#include <algorithm>

namespace pellicle {
inline namespace geometry {

namespace {

/// The rows between which `time` lies (outside all of them the same one twice), and the fraction of the second.
struct Between {
  const std::vector<double>& before;
  const std::vector<double>& after;
  double fraction = 0;
};

Between rows_round(const std::vector<std::vector<double>>& rows, double time) {
  const auto next = std::upper_bound(rows.begin(), rows.end(), time,
                                     [](double t, const std::vector<double>& row) { return t < row[0]; });
  if (next == rows.begin() || next == rows.end()) {
    const auto& row = next == rows.begin() ? rows.front() : rows.back();
    return {row, row, 0};
  }
  const std::vector<double>& before = *(next - 1);
  return {before, *next, (time - before[0]) / ((*next)[0] - before[0])};
}

}  // namespace

Eigen::Vector3d place_on_key_points(const std::vector<std::vector<double>>& rows, double time) {
  const Between at = rows_round(rows, time);
  const auto place = [](const std::vector<double>& row) { return Eigen::Vector3d(row[1], row[2], row[3]); };
  return (1 - at.fraction) * place(at.before) + at.fraction * place(at.after);
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
  const Between at = rows_round(rows, time);
  return (1 - at.fraction) * at.before[1] + at.fraction * at.after[1];
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

std::string fault_of_motion(const std::vector<std::vector<double>>& path, const Eigen::Vector3d& velocity) {
  if (const std::string fault = fault_of_key_points(path); !fault.empty()) {
    return ".path: " + fault;
  }
  if (!path.empty() && !velocity.isZero(0)) {
    return ": both path and velocity given, expected one of them";
  }
  return "";
}

Eigen::Vector3d place_of_motion(const std::vector<std::vector<double>>& path, const Eigen::Vector3d& velocity,
                                double time) {
  return path.empty() ? Eigen::Vector3d(velocity * time) : place_on_key_points(path, time);
}

}  // namespace geometry
}  // namespace pellicle
