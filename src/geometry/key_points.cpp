#include "geometry/key_points.h"

#include <algorithm>

namespace pellicle {

Eigen::Vector3d place_on_key_points(const std::vector<std::vector<double>>& rows, double time) {
  const auto place = [](const std::vector<double>& row) { return Eigen::Vector3d(row[1], row[2], row[3]); };
  const auto next = std::upper_bound(rows.begin(), rows.end(), time,
                                     [](double t, const std::vector<double>& row) { return t < row[0]; });
  if (next == rows.begin()) {
    return place(rows.front());
  }
  if (next == rows.end()) {
    return place(rows.back());
  }
  const std::vector<double>& before = *(next - 1);
  const double share = (time - before[0]) / ((*next)[0] - before[0]);
  return (1 - share) * place(before) + share * place(*next);
}

std::string fault_of_key_points(const std::vector<std::vector<double>>& rows) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string name = "key point " + std::to_string(i + 1);
    if (rows[i].size() != 4) {
      return name + " has " + std::to_string(rows[i].size()) + " numbers, expected 4: time, x, y, z";
    }
    if (i > 0 && !(rows[i][0] > rows[i - 1][0])) {
      return name + " is at " + std::to_string(rows[i][0]) + " s, expected later than the one before";
    }
  }
  return "";
}

std::string fault_of_motion(const std::vector<std::vector<double>>& path, const Eigen::Vector3d& velocity) {
  const std::string fault = fault_of_key_points(path);
  if (!fault.empty()) {
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

}  // namespace pellicle
