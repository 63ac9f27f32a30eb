// Fig. 7 (c) and (d): when one layer shrinks, the projection crumples the sheet where Hooke springs bend it smoothly.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

class Wrinkles : public ProgramTest {
 protected:
  static constexpr int cells = 30;

  /// How rough a sheet is at the end of a run of the deck: root mean square of the angle between a cell's normal and
  /// the mean of its four neighbours' [degrees]. A smooth bend has little of it, whatever its curvature.
  double roughness(const Arguments& decks) const {
    succeed(1, decks + Arguments{"-mesh_cells", "30,30", "-sheet_thickness", "8.333 mm", "-output_interval_time", "1",
                                 "-output_directory", "out", "-output_name", "sheet"});
    const DrawnFrame last = last_frame(folder() / "out" / "sheet.pvd");
    const auto corner = [&](int i, int j) -> Eigen::Vector3d {
      const std::vector<double>& x = last.points.at("position").at(j * (cells + 1) + i);
      return {x[0], x[1], x[2]};
    };
    const auto normal = [&](int i, int j) -> Eigen::Vector3d {
      return (corner(i + 1, j + 1) - corner(i, j)).cross(corner(i, j + 1) - corner(i + 1, j)).normalized();
    };
    double sum = 0;
    for (int j = 1; j + 1 < cells; ++j) {
      for (int i = 1; i + 1 < cells; ++i) {
        const Eigen::Vector3d mean = normal(i - 1, j) + normal(i + 1, j) + normal(i, j - 1) + normal(i, j + 1);
        sum += std::pow(std::atan2(normal(i, j).cross(mean).norm(), normal(i, j).dot(mean)), 2);
      }
    }
    return std::sqrt(sum / ((cells - 2) * (cells - 2))) * 180 / M_PI;
  }
};

TEST_F(Wrinkles, ProjectionCrumplesWhereHookeSpringsBendSmoothly) {
  const double projection =
      roughness({deck_path("uniform_shrink"), deck_path("paper_sheet"), "-combustion_mass_loss_range", "1,1"});
  const double springs = roughness({deck_path("uniform_shrink_spring")});
  std::printf("roughness: projection %.1f degrees, springs %.1f degrees\n", projection, springs);
  EXPECT_GT(projection, 4 * springs);
}

}  // namespace
}  // namespace pellicle
