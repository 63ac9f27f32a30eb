#include "elastic/bending_stencils.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <utility>

namespace pellicle::elastic {

namespace {

/// Curvatures count as not determined if all but this fraction of the heights that they give is a tilt. Measured in
/// coordinates in which the points spread alike in all directions: any parallelogram of 3 x 3 points has 0.71 then,
/// shaken ones 0.5 and more, edges of the sheet less than 0.17.
constexpr double determined = 0.3;

/// Curvature as (B11, sqrt(2) B12, B22), of which the norm is that of the tensor.
using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// Heights of a surface with curvature, row by row for each point.
Columns heights_of(const Eigen::Matrix2Xd& points) {
  Columns result(points.cols(), 3);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const double x = points(0, k);
    const double y = points(1, k);
    result.row(k) << x * x / 2, x * y / std::sqrt(2.0), y * y / 2;
  }
  return result;
}

/// The heights without their weighted fit by a tilt. @param weights roots of those of the squares
Columns without_tilt(const Columns& heights, const Eigen::Matrix2Xd& points, const Eigen::VectorXd& weights) {
  const Eigen::MatrixX2d tilt = weights.asDiagonal() * points.transpose();
  Eigen::ColPivHouseholderQR<Eigen::MatrixX2d> factors(tilt);
  return heights - tilt * factors.solve(heights);
}

/// The tensor r^T B r for coordinates that were mapped by `map`.
Eigen::Matrix3d transformed(const Eigen::Matrix2d& map) {
  const double root = std::sqrt(2.0);
  const auto column = [&](const Eigen::Matrix2d& tensor) -> Eigen::Vector3d {
    const Eigen::Matrix2d in_new = map.transpose() * tensor * map;
    return {in_new(0, 0), root * in_new(0, 1), in_new(1, 1)};
  };
  Eigen::Matrix2d e11 = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d e12 = e11;
  Eigen::Matrix2d e22 = e11;
  e11(0, 0) = e22(1, 1) = 1;
  e12(0, 1) = e12(1, 0) = 1 / root;
  Eigen::Matrix3d result;
  result << column(e11), column(e12), column(e22);
  return result;
}

/// Weights of the heights at some points, of which the sum with these is the curvature, by columns. @param is_clamped
/// if the tangent plane is fixed
Eigen::Matrix3Xd curvature_weights(const Eigen::Matrix2Xd& points, bool is_clamped) {
  // Coordinates in which the points spread alike, r = S^(1/2) s.
  const Eigen::Matrix2d spread = points * points.transpose() / static_cast<double>(points.cols());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
  const auto weights_of = [](const Eigen::Matrix2Xd& at) -> Eigen::VectorXd {
    return at.colwise().squaredNorm().cwiseInverse().transpose();
  };
  const auto seen_in = [is_clamped](const Columns& heights, const Eigen::Matrix2Xd& at,
                                    const Eigen::VectorXd& weights) -> Columns {
    return is_clamped ? heights : without_tilt(heights, at, weights);
  };
  const Eigen::Matrix2Xd alike = axes.operatorInverseSqrt() * points;
  const Columns all = weights_of(alike).asDiagonal() * heights_of(alike);
  const double largest = Eigen::JacobiSVD<Eigen::MatrixXd>(all).singularValues()[0];
  const Eigen::JacobiSVD<Eigen::MatrixXd> values(seen_in(all, alike, weights_of(alike)), Eigen::ComputeFullV);
  // B in r is S^(-1/2) B' S^(-1/2) of B' in s. What is not determined stays 0.
  const Eigen::Matrix3d to_real = transformed(axes.operatorInverseSqrt());
  Eigen::Index rank = 0;
  while (rank < values.singularValues().size() && values.singularValues()[rank] > determined * largest) {
    ++rank;
  }
  Eigen::Matrix3d basis = Eigen::Matrix3d::Identity();
  if (rank < 3) {
    const Eigen::MatrixXd unknown = to_real * values.matrixV().rightCols(3 - rank);
    basis = Eigen::HouseholderQR<Eigen::MatrixXd>(unknown).householderQ();
  }
  const Eigen::MatrixXd known = basis.rightCols(rank);
  const Eigen::VectorXd weights = weights_of(points);
  const Columns heights = weights.asDiagonal() * heights_of(points);
  const Eigen::MatrixXd products = seen_in(heights, points, weights) * known;
  const Eigen::MatrixXd inverse = products.completeOrthogonalDecomposition().pseudoInverse();
  return known * inverse * weights.asDiagonal();
}

}  // namespace

BendingStencils::BendingStencils(const Sheet& sheet, const Eigen::Vector3d& warp, const std::vector<bool>& clamped)
    : sheet_(&sheet), warp_(warp_of(sheet, warp)), cell_area_(cell_areas(sheet)) {
  const std::size_t particles = sheet.particles.local();
  // A corner of n cells has at most 2 n + 2 points.
  stencils_.reserve(particles);
  points_.reserve(8 * sheet.cells.size() + 2 * particles);
  support_.reserve(points_.capacity());
  cells_.reserve(4 * sheet.cells.size());
  const Incidence cells_at(sheet.cells, sheet.particles.local());
  for (std::size_t i = 0; i < particles; ++i) {
    if (const auto corner = static_cast<PetscInt>(i); !sheet.is_lattice[i] && cells_at[corner].size() > 0) {
      add_corner(corner, cells_at[corner], clamped[i]);
    }
  }
  counts_.assign(cells_.size(), true);
  takes_part_.assign(points_.size(), false);
  weights_.assign(points_.size(), Curvature3::Zero());
  update(ActiveSet(sheet));
}

void BendingStencils::add_corner(PetscInt corner, Incidence::Range cells, bool is_clamped) {
  std::vector<std::pair<PetscInt, Support>> neighbours;
  neighbours.reserve(3 * static_cast<std::size_t>(cells.size()));
  Stencil& stencil = stencils_.emplace_back();
  stencil.centre = corner;
  stencil.first = points_.size();
  stencil.first_cell = cells_.size();
  bool is_inside = cells.size() > 2;
  for (const PetscInt cell : cells) {
    const auto& corners = sheet_->cells[cell];
    const auto k = static_cast<PetscInt>(std::find(corners.begin(), corners.end(), corner) - corners.begin());
    const std::size_t n = cells_.size() - stencil.first_cell;
    cells_.push_back({cell, k});
    for (const PetscInt next : {1, 2, 3}) {
      const PetscInt neighbour = corners[(k + next) % 4];
      const auto known = std::find_if(neighbours.begin(), neighbours.end(), [&](const auto& beside) {
        return beside.first == neighbour && !beside.second.is_opposite;
      });
      if (next == 2 || known == neighbours.end()) {
        neighbours.push_back({neighbour, {{n, n}, next == 2}});
      } else {
        known->second.cells[1] = n;
      }
    }
  }
  for (const auto& [neighbour, support] : neighbours) {
    is_inside = is_inside && (support.is_opposite || support.cells[0] != support.cells[1]);
  }
  stencil.last_cell = cells_.size();
  stencil.is_clamped = is_clamped && !is_inside;
  std::sort(neighbours.begin(), neighbours.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  points_.push_back(corner);
  support_.emplace_back();
  for (const auto& [neighbour, support] : neighbours) {
    points_.push_back(neighbour);
    support_.push_back(support);
  }
  stencil.last = points_.size();
}

/// @returns whether the stencil is used @param takes_part set for its points @param counts set for its cells
bool BendingStencils::find_part(const Stencil& stencil, const ActiveSet& active, std::vector<bool>& takes_part,
                                std::vector<bool>& counts) const {
  counts.assign(stencil.last_cell - stencil.first_cell, true);
  std::size_t count = 0;
  for (std::size_t c = 0; c < counts.size(); ++c) {
    const CellAt& cell = cells_[stencil.first_cell + c];
    counts[c] = active.triangles[cell.triangle(0)] && active.triangles[cell.triangle(3)];
    count += counts[c];
  }
  takes_part.assign(stencil.last - stencil.first, true);
  std::size_t neighbours = 0;
  for (std::size_t p = 1; p < takes_part.size(); ++p) {
    const auto& [cells, is_opposite] = support_[stencil.first + p];
    takes_part[p] = counts[cells[0]] || counts[cells[1]];
    if (is_opposite) {
      const CellAt& cell = cells_[stencil.first_cell + cells[0]];
      takes_part[p] = takes_part[p] && (active.triangles[cell.triangle(1)] || active.triangles[cell.triangle(2)]);
    } else {
      neighbours += takes_part[p];
    }
  }
  const bool is_whole = count == counts.size();
  if (stencil.is_clamped) {
    return is_whole;
  }
  return is_whole && neighbours == count ? count > 2 : count > 0 && neighbours == count + 1;
}

void BendingStencils::update(const ActiveSet& active) {
  if (active.triangles == active_before_) {
    return;
  }
  active_before_ = active.triangles;
  std::vector<bool> is_used(sheet_->particles.local(), false);  // the stencil of each corner
  std::vector<bool> takes_part;
  std::vector<bool> counts;
  for (Stencil& stencil : stencils_) {
    if (!find_part(stencil, active, takes_part, counts)) {
      continue;
    }
    const auto before = takes_part_.begin() + static_cast<std::ptrdiff_t>(stencil.first);
    if (!std::equal(takes_part.begin(), takes_part.end(), before)) {
      std::copy(takes_part.begin(), takes_part.end(), before);
      std::copy(counts.begin(), counts.end(), counts_.begin() + static_cast<std::ptrdiff_t>(stencil.first_cell));
      fit(stencil);
      ++fits_;
    }
    is_used[stencil.centre] = true;
  }
  // A cell's area goes in equal parts to those of its corners whose stencil it takes part in.
  std::vector<double> area(is_used.size(), 0);
  for (std::size_t cell = 0; cell < sheet_->cells.size(); ++cell) {
    std::array<bool, 4> takes{};
    for (std::size_t k = 0; k < 4; ++k) {
      takes[k] =
          is_used[sheet_->cells[cell][k]] && active.triangles[4 * cell + k] && active.triangles[4 * cell + (k + 3) % 4];
    }
    const auto count = static_cast<double>(std::count(takes.begin(), takes.end(), true));
    for (std::size_t k = 0; k < 4; ++k) {
      area[sheet_->cells[cell][k]] += takes[k] ? cell_area_[cell] / count : 0;
    }
  }
  for (Stencil& stencil : stencils_) {
    stencil.area = is_used[stencil.centre] ? area[stencil.centre] : 0;
  }
}

void BendingStencils::fit(Stencil& stencil) {
  std::fill_n(weights_.begin() + static_cast<std::ptrdiff_t>(stencil.first), stencil.last - stencil.first,
              Curvature3::Zero());
  stencil.rest.setZero();
  const Eigen::Vector3d centre = sheet_->rest.col(stencil.centre);
  const Eigen::Vector3d normal = area_vector(stencil, sheet_->rest.data()).normalized();
  const Eigen::Vector3d along = warp_.col(stencil.centre);
  const Eigen::Vector3d warp = (along - normal.dot(along) * normal).normalized();
  const Eigen::Vector3d weft = normal.cross(warp);
  std::vector<std::size_t> used;  // the points that take part, but for the centre
  for (std::size_t point = stencil.first + 1; point < stencil.last; ++point) {
    if (takes_part(point)) {
      used.push_back(point);
    }
  }
  Eigen::Matrix3Xd arms(3, used.size());
  for (std::size_t k = 0; k < used.size(); ++k) {
    arms.col(static_cast<Eigen::Index>(k)) = sheet_->rest.col(points_[used[k]]) - centre;
  }
  Eigen::Matrix2Xd in_plane(2, used.size());
  in_plane << warp.transpose() * arms, weft.transpose() * arms;
  const double length = std::sqrt(in_plane.squaredNorm() / static_cast<double>(used.size()));
  const Eigen::Matrix3Xd weights = curvature_weights(in_plane / length, stencil.is_clamped) / (length * length);
  for (std::size_t k = 0; k < used.size(); ++k) {
    Curvature3 weight = weights.col(static_cast<Eigen::Index>(k));
    weight[1] /= std::sqrt(2.0);
    weights_[used[k]] = weight;
    weights_[stencil.first] -= weight;
    stencil.rest += weight * normal.dot(arms.col(static_cast<Eigen::Index>(k)));
  }
}

}  // namespace pellicle::elastic
