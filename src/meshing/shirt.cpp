#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/sorting.h"
#include "geometry/pi.h"
#include "meshing/generators.h"

namespace pellicle::meshing {

namespace {

// The cut, laid flat: fractions of the torso's width, and the sleeves' width as a fraction of the height. These, and
// the figures of fit(), were found by trial: they make the edges most alike.
constexpr double sleeve_length = 0.42;
constexpr double sleeve_width = 0.30;
constexpr double shoulder_length = 0.32;  // of each, so that the neck has the rest
constexpr double neck_depth_front = 0.083;
constexpr double neck_depth_back = 0.03;

/// `count` + 1 points of the half ellipse from centre + across over centre + outward to centre - across, at equal
/// distances along it.
std::vector<Eigen::Vector3d> half_ellipse(const Eigen::Vector3d& centre, const Eigen::Vector3d& across,
                                          const Eigen::Vector3d& outward, int count) {
  const auto at = [&](double angle) -> Eigen::Vector3d {
    return centre + std::cos(angle) * across + std::sin(angle) * outward;
  };
  constexpr int samples = 2000;
  std::vector<double> length{0};
  for (int k = 1; k <= samples; ++k) {
    length.push_back(length.back() + (at(pi * k / samples) - at(pi * (k - 1) / samples)).norm());
  }
  std::vector<Eigen::Vector3d> points;
  int k = 1;
  for (int i = 0; i <= count; ++i) {
    const double wanted = length.back() * i / count;
    while (k < samples && length[k] < wanted) {
      ++k;
    }
    const double before = length[k - 1];
    points.push_back(at(pi * (k - 1 + (wanted - before) / (length[k] - before)) / samples));
  }
  return points;
}

/// The cut of front and back on a lattice of nodes (i, j): the torso's are 0 <= i <= across, 0 <= j <= up, the sleeves
/// go on to both sides, up from row `armpit`. Nodes of the back on a seam are those of the front.
class Cut {
 public:
  enum Side { front, back };

  explicit Cut(std::array<int, 2> cells)
      : across(cells[0]),
        up(cells[1]),
        sleeve(fraction(sleeve_length, across)),
        armpit(up - std::max(2, fraction(sleeve_width, up))),
        shoulder(fraction(shoulder_length, across)),
        neck_depth{fraction(neck_depth_front, across), fraction(neck_depth_back, across)} {
    for (const Side side : {front, back}) {
      number_[side].setConstant(width() + 1, up + 1, -1);
      for (int j = 0; j <= up; ++j) {
        for (int i = -sleeve; i <= across + sleeve; ++i) {
          if (is_cell(side, i, j) || is_cell(side, i - 1, j) || is_cell(side, i, j - 1) ||
              is_cell(side, i - 1, j - 1)) {
            number_[side](i + sleeve, j) = side == back && is_seam(i, j) ? point(front, i, j) : points++;
          }
        }
      }
    }
  }

  int width() const { return across + 2 * sleeve; }
  /// Point at a node, or -1.
  int point(Side side, int i, int j) const { return number_[side](i + sleeve, j); }
  /// Whether the cell with this lower left node is there.
  bool is_cell(Side side, int i, int j) const {
    const bool in_torso = i >= 0 && i < across && j >= 0 && j < up;
    const bool in_sleeve = i >= -sleeve && i < across + sleeve && j >= armpit && j < up;
    const bool in_neck = i >= shoulder && i < across - shoulder && j >= up - neck_depth[side];
    return (in_torso || in_sleeve) && !in_neck;
  }

  const int across;
  const int up;
  const int sleeve;
  const int armpit;
  const int shoulder;
  const std::array<int, 2> neck_depth;  ///< of each side
  int points = 0;

 private:
  static int fraction(double part, int whole) { return std::max(1, static_cast<int>(std::lround(part * whole))); }
  bool is_seam(int i, int j) const {
    const bool at_side = (i == 0 || i == across) && j <= armpit;
    const bool under_sleeve = (i <= 0 || i >= across) && j == armpit;
    const bool on_top = (i <= shoulder || i >= across - shoulder) && j == up;
    return at_side || under_sleeve || on_top;
  }

  std::array<Eigen::ArrayXXi, 2> number_;  ///< of the points of each side
};

/// Front and back sewn together; the points have no place yet.
SurfaceMesh sew(const Cut& cut) {
  SurfaceMesh mesh;
  mesh.points.resize(cut.points, Eigen::Vector3d::Zero());
  for (const Cut::Side side : {Cut::front, Cut::back}) {
    for (int j = 0; j < cut.up; ++j) {
      for (int i = -cut.sleeve; i < cut.across + cut.sleeve; ++i) {
        if (!cut.is_cell(side, i, j)) {
          continue;
        }
        std::vector<int>& face = mesh.faces.emplace_back();
        std::vector<Eigen::Vector2d>& uv = mesh.uv.emplace_back();
        for (const auto& [a, b] :
             {std::pair(i, j), std::pair(i + 1, j), std::pair(i + 1, j + 1), std::pair(i, j + 1)}) {
          const double u = 0.5 * (a + cut.sleeve) / cut.width();
          face.push_back(cut.point(side, a, b));
          uv.emplace_back(side == Cut::front ? u : 1 - u, static_cast<double>(b) / cut.up);
        }
        if (side == Cut::back) {
          std::reverse(face.begin(), face.end());
          std::reverse(uv.begin(), uv.end());
        }
      }
    }
  }
  return mesh;
}

/// Whether a point has its place, and whether it is at an opening.
enum class Hold { free, held, rim };

/// Gives the rims, the straight parts behind them and the shoulder seams their places, and names the groups.
std::vector<Hold> fit(SurfaceMesh& mesh, const Cut& cut, double width, double height) {
  using Vector = Eigen::Vector3d;
  std::vector<Hold> holds(mesh.points.size(), Hold::free);
  const auto hold = [&](int point, const Vector& place) {
    mesh.points[point] = place;
    holds[point] = std::max(holds[point], Hold::held);
  };
  const auto hold_rim = [&](int point, const Vector& place, const char* group) {
    mesh.points[point] = place;
    holds[point] = Hold::rim;
    mesh.groups[group].push_back(point);
  };
  const double cell = width / cut.across;
  const double row = height / cut.up;
  const int straight_rows = std::max(1, cut.armpit - static_cast<int>(std::lround(0.21 * cut.across)));
  const int straight_columns = std::max(1, static_cast<int>(std::lround(0.7 * cut.sleeve)));
  const int sleeve_rows = cut.up - cut.armpit;
  const double half_girth = 0.97 * row * sleeve_rows;
  const double half_neck = 0.17 * width;
  for (const Cut::Side side : {Cut::front, Cut::back}) {
    const Vector outward(0, side == Cut::front ? -1 : 1, 0);
    // Half of an ellipse with the half axes 0.40 and 0.23 is 1.0 long; with 0.37 and 0.26 too.
    const auto waist = half_ellipse({0, 0, -0.5 * height}, {-0.40 * width, 0, 0}, 0.23 * width * outward, cut.across);
    for (int i = 0; i <= cut.across; ++i) {
      const Vector& place = waist[i];
      hold_rim(cut.point(side, i, 0), place, "waist");
      for (int j = 1; j <= straight_rows; ++j) {
        hold(cut.point(side, i, j), place + Vector(0, 0, j * row));
      }
    }
    for (const int right : {-1, 1}) {
      const double slope = 0.45;
      const Vector along(right * std::cos(slope), 0, -std::sin(slope));
      const Vector upwards(right * std::sin(slope), 0, std::cos(slope));
      const Vector root(right * 0.45 * width, 0, 0.33 * height);
      const auto cuff = half_ellipse(root + cell * cut.sleeve * along, -0.37 * half_girth * upwards,
                                     0.26 * half_girth * outward, sleeve_rows);
      const int end = right > 0 ? cut.across + cut.sleeve : -cut.sleeve;
      for (int j = 0; j <= sleeve_rows; ++j) {
        const Vector& place = cuff[j];
        hold_rim(cut.point(side, end, cut.armpit + j), place, "cuffs");
        for (int k = 1; k <= straight_columns; ++k) {
          hold(cut.point(side, end - right * k, cut.armpit + j), place - k * cell * along);
        }
      }
    }
    // The neckline goes down beside the neck, across, and up again.
    const int depth = cut.neck_depth[side];
    const int neck_cells = cut.across - 2 * cut.shoulder;
    const int count = neck_cells + 2 * depth;
    const Vector to_middle = width * (side == Cut::front ? Vector(0, -0.17, -0.10) : Vector(0, 0.125, -0.02));
    const auto neck = half_ellipse({0, 0, 0.5 * height}, {-half_neck, 0, 0}, to_middle, count);
    for (int k = 0; k <= count; ++k) {
      const int i = cut.shoulder + std::clamp(k - depth, 0, neck_cells);
      const int j = cut.up - std::min({k, depth, count - k});
      hold_rim(cut.point(side, i, j), neck[k], "neck");
    }
  }
  for (int k = 0; k <= cut.shoulder; ++k) {
    const double slope = 0.27;
    const Vector place(half_neck + k * cell * std::cos(slope), 0, 0.5 * height - k * cell * std::sin(slope));
    const int left = cut.point(Cut::front, cut.shoulder - k, cut.up);
    const int right = cut.point(Cut::front, cut.across - cut.shoulder + k, cut.up);
    hold(left, place.cwiseProduct(Vector(-1, 1, 1)));
    hold(right, place);
    mesh.groups["shoulders"].insert(mesh.groups["shoulders"].end(), {left, right});
  }
  for (auto& group : mesh.groups) {
    group.second = without_repeats(std::move(group.second));
  }
  return holds;
}

/// Puts all other points where the sum of squared umbrella vectors of the points off the rims is least.
void span(SurfaceMesh& mesh, const std::vector<Hold>& holds) {
  const auto points = static_cast<Eigen::Index>(mesh.points.size());
  std::vector<Eigen::Triplet<double>> entries;
  for (const std::vector<int>& face : mesh.faces) {
    for (std::size_t k = 0; k < 4; ++k) {
      // The other face at the edge goes along it the other way.
      if (holds[face[k]] != Hold::rim) {
        entries.emplace_back(face[k], face[(k + 1) % 4], 1);
        entries.emplace_back(face[k], face[k], -1);
      }
    }
  }
  Eigen::SparseMatrix<double> umbrella(points, points);
  umbrella.setFromTriplets(entries.begin(), entries.end());

  // x = known + free y, known 0 where a point is free.
  entries.clear();
  int count = 0;
  Eigen::MatrixX3d known(points, 3);
  for (Eigen::Index i = 0; i < points; ++i) {
    known.row(i) = mesh.points[i];
    if (holds[i] == Hold::free) {
      entries.emplace_back(static_cast<int>(i), count++, 1);
    }
  }
  Eigen::SparseMatrix<double> free(points, count);
  free.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseMatrix<double> of_free = umbrella * free;
  const Eigen::SparseMatrix<double> normal_equations = of_free.transpose() * of_free;
  const Eigen::MatrixX3d side = -(of_free.transpose() * (umbrella * known));
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(normal_equations);
  const Eigen::MatrixX3d found = known + free * factors.solve(side);
  for (Eigen::Index i = 0; i < points; ++i) {
    mesh.points[i] = found.row(i);
  }
}

}  // namespace

SurfaceMesh shirt_mesh(std::array<int, 2> cells, std::array<double, 2> size) {
  refuse_if(cells[0] < 8 || cells[1] < 8 || !(size[0] > 0 && size[1] > 0),
            "a shirt of {} x {} cells and {:g} m x {:g} m, expected at least 8 x 8 cells and sizes above 0", cells[0],
            cells[1], size[0], size[1]);
  require_mesh_size(fmt::format("a shirt of {} x {} cells", cells[0], cells[1]),
                    2.0 * cells[0] * cells[1]);  // front and back, without the sleeves
  const Cut cut(cells);
  SurfaceMesh mesh = sew(cut);
  span(mesh, fit(mesh, cut, size[0], size[1]));
  return mesh;
}

}  // namespace pellicle::meshing
