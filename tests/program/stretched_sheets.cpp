// Wrinkles of a sheet that is stretched between two clamps, against the formula of Cerda and Mahadevan.

#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

/// What the last frame of a run of input/stretched_sheet.yaml shows.
struct WrinkledShape {
  double tension = 0;     ///< T in the middle [N/m]: the strain there times the tensile stiffness
  double height = 0;      ///< largest distance from the plane [m]
  double wavelength = 0;  ///< in the middle of the length, over the middle half of the width [m]
  double length = 0;      ///< of a wave sin(pi x / length) that slopes as much along the tension for its height [m]
};

constexpr double sheet_length = 1;             // [m], as in the deck
constexpr double sheet_width = 0.4;            // [m]
constexpr double tensile_stiffness = 1000;     // [N/m]
constexpr double bending_stiffness = 1.65e-6;  // [N m]

/// lambda = 2 sqrt(pi) (D/T)^(1/4) L^(1/2) of wrinkles of length L [m].
double formula(double tension, double length) {
  return 2 * std::sqrt(std::acos(-1.0)) * std::pow(bending_stiffness / tension, 0.25) * std::sqrt(length);
}

/// Slope of u over x, a straight line fitted to what is undeformed within the middle half of the length.
double strain_in_the_middle(const DrawnFrame& first, const DrawnFrame& last) {
  double sum = 0, sum_x = 0, sum_u = 0, sum_xx = 0, sum_xu = 0;
  for (const auto& [id, start] : first.points.at("position")) {
    const double x = start[0];
    if (std::abs(x) <= sheet_length / 4) {
      const double u = last.points.at("position").at(id)[0] - x;
      sum += 1;
      sum_x += x;
      sum_u += u;
      sum_xx += x * x;
      sum_xu += x * u;
    }
  }
  return (sum_xu - sum_x * sum_u / sum) / (sum_xx - sum_x * sum_x / sum);
}

/// Twice the mean distance of zeros of the profile z(y) of the column of points in the middle of the length.
double wavelength_in_the_middle(const DrawnFrame& first, const DrawnFrame& last, double cell_length) {
  std::map<double, double> profile;
  for (const auto& [id, start] : first.points.at("position")) {
    const std::vector<double>& place = last.points.at("position").at(id);
    if (std::abs(start[0]) < cell_length / 4 && std::abs(place[1]) <= sheet_width / 4) {
      profile[place[1]] = place[2];
    }
  }
  std::vector<double> zeros;
  for (auto right = profile.begin(), left = right++; right != profile.end(); left = right++) {
    if (left->second * right->second < 0) {
      zeros.push_back(left->first - left->second * (right->first - left->first) / (right->second - left->second));
    }
  }
  return zeros.size() < 3 ? 0 : 2 * (zeros.back() - zeros.front()) / static_cast<double>(zeros.size() - 1);
}

/// pi sqrt(sum of a^2 / sum of (da/dx)^2), a the root mean square of z across the middle half of the width, by column
/// of corner points.
double length_of_wrinkles(const DrawnFrame& first, const DrawnFrame& last, const std::array<int, 2>& cells) {
  std::vector<double> squares(cells[0] + 1, 0);
  for (const auto& [id, start] : first.points.at("position")) {
    const double column = (start[0] / sheet_length + 0.5) * cells[0];
    const bool is_corner = std::abs(column - std::round(column)) < 0.25;
    if (is_corner && std::abs(start[1]) <= sheet_width / 4) {
      squares[std::lround(column)] += std::pow(last.points.at("position").at(id)[2], 2);
    }
  }
  double slopes = 0;
  for (std::size_t i = 1; i < squares.size(); ++i) {
    slopes += std::pow((std::sqrt(squares[i]) - std::sqrt(squares[i - 1])) * cells[0] / sheet_length, 2);
  }
  return std::acos(-1.0) * std::sqrt(std::accumulate(squares.begin(), squares.end(), 0.0) / slopes);
}

class StretchedSheets : public ProgramTest {
 protected:
  /// @param pull by which the clamps move apart [m] @param cells along and across the tension
  WrinkledShape stretch(const std::string& pull, const std::array<int, 2>& cells) const {
    const std::string mesh = std::to_string(cells[0]) + "," + std::to_string(cells[1]);
    succeed(1, {deck_path("stretched_sheet"), "-mesh_cells", mesh, "-pins_right_path", "0,0,0,0;0.07," + pull + ",0,0",
                "-time_end", "0.84", "-output_interval_time", "10", "-output_directory", "out"});
    const auto frames = read_pvd(folder() / "out" / "stretched_sheet.pvd");
    const DrawnFrame first = read_frame(frames.front().first, frames.front().second);
    const DrawnFrame last = read_frame(frames.back().first, frames.back().second);
    const double cell_length = sheet_length / cells[0];
    const auto [lowest, highest] = range_of(last.points.at("position"), 2);
    const WrinkledShape found{tensile_stiffness * strain_in_the_middle(first, last), std::max(-lowest, highest),
                              wavelength_in_the_middle(first, last, cell_length),
                              length_of_wrinkles(first, last, cells)};
    std::printf(
        "%s cells, %s m: tension %.3f N/m, height %.3f mm, wavelength %.4f m; %.4f m by the formula, %.4f m for "
        "wrinkles as long as these, %.3f m\n",
        mesh.c_str(), pull.c_str(), found.tension, 1e3 * found.height, found.wavelength,
        formula(found.tension, sheet_length), formula(found.tension, found.length), found.length);
    return found;
  }

  void expect_formula(const std::string& pull, const std::array<int, 2>& cells) const {
    const WrinkledShape found = stretch(pull, cells);
    EXPECT_GT(found.height, 1e-4) << "of 1e-4 m were the first displacements";
    const double expected = formula(found.tension, sheet_length);
    EXPECT_NEAR(found.wavelength, expected, 0.2 * expected) << pull << " m";
  }
};

TEST_F(StretchedSheets, WrinkleByTheFormula) {
  for (const char* pull : {"2e-3", "4e-3", "8e-3"}) {
    expect_formula(pull, {87, 24});
  }
}

class LongStretchedSheets : public StretchedSheets {};

TEST_F(LongStretchedSheets, WrinkleByTheFormulaOnFinerMeshes) {
  set_time_limit(1500);
  for (const std::array<int, 2> cells : {std::array{116, 32}, std::array{160, 44}}) {
    for (const char* pull : {"2e-3", "4e-3", "8e-3"}) {
      expect_formula(pull, cells);
    }
  }
}

}  // namespace
}  // namespace pellicle
