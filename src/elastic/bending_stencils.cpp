#include "elastic/bending_stencils.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <utility>

namespace pellicle::elastic {

namespace {

/// Singular values below this fraction of the largest count as zero, so that terms that the points do not determine are
/// left out.
constexpr double negligible = 1e-6;

/// Condition of the terms, each of unit length, up to which the points at an edge determine a surface. Square cells
/// have 7, a corner of two cells between sides at a right angle 50.
constexpr double worst_determined = 25;

using Terms = Eigen::Matrix<double, 5, Eigen::Dynamic>;

/// Terms of a quadratic surface at a point of its undeformed tangent plane. @param is_clamped if this plane is fixed
Eigen::Matrix<double, 5, 1> terms_at(const Eigen::Vector2d& point, bool is_clamped) {
  const double tilt = is_clamped ? 0 : 1;
  const double x = point.x();
  const double y = point.y();
  return {tilt * x, tilt * y, x * x / 2, x * y, y * y / 2};
}

/// Whether the heights of at least five points determine the surface well.
bool determine_surface(const Terms& terms) {
  const Eigen::MatrixXd alike = terms.rowwise().normalized();
  const Eigen::VectorXd values = Eigen::JacobiSVD<Eigen::MatrixXd>(alike).singularValues();
  return values[0] <= worst_determined * values[4];
}

/// Pseudo-inverse of the transposed terms.
Terms pseudo_inverse(const Terms& terms) {
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  constexpr double well_conditioned = 1e-3;  // of the products, in which little is lost then
  const Matrix5 products = terms.lazyProduct(terms.transpose());
  const Eigen::LDLT<Matrix5> factors(products);
  if (factors.vectorD().minCoeff() > well_conditioned * factors.vectorD().maxCoeff()) {
    const Matrix5 inverse = factors.solve(Matrix5::Identity());
    return inverse.lazyProduct(terms);
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  decomposition.setThreshold(negligible);
  decomposition.compute(terms.transpose());
  return decomposition.pseudoInverse();
}

}  // namespace

BendingStencils::BendingStencils(const Sheet& sheet, const Eigen::Vector3d& warp, const std::vector<bool>& clamped)
    : sheet_(&sheet), warp_(warp_of(sheet, warp)), cell_area_(cell_areas(sheet)) {
  const std::size_t particles = sheet.particles.local();
  std::vector<bool> is_near(particles, false);  // itself or a neighbour is this rank's
  std::fill_n(is_near.begin(), sheet.particles.owned, true);
  for (const Colour colour : {Colour::red, Colour::green, Colour::blue}) {
    for (const auto& [a, b] : sheet.of(colour).ends) {
      if (a < sheet.particles.owned || b < sheet.particles.owned) {
        is_near[a] = true;
        is_near[b] = true;
      }
    }
  }
  // A cell has at most 9 points and 4 triangles, a corner of n cells at most 2 n + 2 points and 2 n triangles.
  stencils_.reserve(particles);
  points_.reserve(17 * sheet.cells.size() + 2 * particles);
  support_.reserve(points_.capacity());
  triangles_.reserve(12 * sheet.cells.size());
  const std::vector<PetscInt> beyond = sides_beyond(sheet);
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    if (is_near[sheet.lattice[cell]]) {
      add_lattice(static_cast<PetscInt>(cell), beyond);
    }
  }
  const Incidence cells_at(sheet.cells, sheet.particles.local());
  for (std::size_t i = 0; i < particles; ++i) {
    if (!sheet.is_lattice[i]) {
      // Whether the corners of a near lattice point have a stencil must be known, too.
      add_corner(static_cast<PetscInt>(i), cells_at[static_cast<PetscInt>(i)], clamped[i]);
    }
  }
  counts_.assign(triangles_.size(), true);
  takes_part_.assign(points_.size(), false);
  weights_.assign(points_.size(), Curvature3::Zero());
  update(ActiveSet(sheet));
}

void BendingStencils::begin_stencil(PetscInt centre) {
  Stencil& stencil = stencils_.emplace_back();
  stencil.centre = centre;
  stencil.first = points_.size();
  stencil.first_triangle = triangles_.size();
  add_point(centre, {-1, -1});
}

void BendingStencils::add_point(PetscInt particle, Support support) {
  points_.push_back(particle);
  support_.push_back(support);
  stencils_.back().last = points_.size();
}

void BendingStencils::add_triangle(PetscInt triangle) {
  triangles_.push_back(triangle);
  stencils_.back().last_triangle = triangles_.size();
}

void BendingStencils::add_lattice(PetscInt cell, const std::vector<PetscInt>& beyond) {
  begin_stencil(sheet_->lattice[cell]);
  for (PetscInt k = 0; k < 4; ++k) {
    add_point(sheet_->cells[cell][k], {-1, -1});
    const PetscInt side = 4 * cell + k;
    if (const PetscInt other = beyond[side]; other >= 0) {
      add_point(sheet_->lattice[other / 4], {side, other});
    }
    add_triangle(side);
  }
}

void BendingStencils::add_corner(PetscInt corner, Incidence::Range cells, bool is_clamped) {
  const auto side_of = [&](PetscInt cell) {  // from the corner to the next
    const auto& corners = sheet_->cells[cell];
    return static_cast<std::size_t>(std::find(corners.begin(), corners.end(), corner) - corners.begin());
  };
  std::vector<std::pair<PetscInt, Support>> neighbours;
  neighbours.reserve(2 * static_cast<std::size_t>(cells.size()));
  for (PetscInt n = 0; n < cells.size(); ++n) {
    const auto& corners = sheet_->cells[cells[n]];
    const std::size_t k = side_of(cells[n]);
    for (const PetscInt neighbour : {corners[(k + 1) % 4], corners[(k + 3) % 4]}) {
      const PetscInt lattice = 1 + n;
      const auto known = std::find_if(neighbours.begin(), neighbours.end(),
                                      [&](const auto& beside) { return beside.first == neighbour; });
      if (known == neighbours.end()) {
        neighbours.push_back({neighbour, {lattice, lattice}});
      } else {
        known->second[1] = lattice;
      }
    }
  }
  std::sort(neighbours.begin(), neighbours.end());
  const bool is_inside = cells.size() > 2 && std::all_of(neighbours.begin(), neighbours.end(), [](const auto& beside) {
                           return beside.second[0] != beside.second[1];
                         });
  if (cells.size() < 2 && !is_clamped) {
    return;
  }
  begin_stencil(corner);
  stencils_.back().is_clamped = is_clamped && !is_inside;
  for (const PetscInt cell : cells) {
    const auto k = static_cast<PetscInt>(side_of(cell));
    const PetscInt first = 4 * cell + k;
    const PetscInt last = 4 * cell + (k + 3) % 4;
    add_point(sheet_->lattice[cell], {first, last});
    add_triangle(first);
    add_triangle(last);
  }
  for (const auto& [neighbour, support] : neighbours) {
    add_point(neighbour, support);
  }
}

bool BendingStencils::find_part(const Stencil& stencil, const ActiveSet& active, std::vector<bool>& takes_part) const {
  const auto lives = [&active](PetscInt triangle) { return triangle < 0 || active.triangles[triangle]; };
  const auto first = triangles_.begin() + static_cast<std::ptrdiff_t>(stencil.first_triangle);
  const auto last = triangles_.begin() + static_cast<std::ptrdiff_t>(stencil.last_triangle);
  takes_part.assign(stencil.last - stencil.first, true);
  const bool is_whole = std::all_of(first, last, lives);
  if (stencil.is_clamped) {
    return is_whole;
  }
  if (sheet_->is_lattice[stencil.centre]) {
    for (std::size_t k = 0; k < takes_part.size(); ++k) {
      const auto [side, opposite] = support_[stencil.first + k];
      takes_part[k] = lives(side) && lives(opposite) && (side < 0 || !active.cracked[side]);
    }
    return is_whole;
  }
  // Triangles of active cells: all round the corner, or one fan.
  const std::size_t cells = (stencil.last_triangle - stencil.first_triangle) / 2;
  std::size_t count = 0;
  std::size_t neighbours = 0;
  for (std::size_t k = 1; k < takes_part.size(); ++k) {
    const auto [one, other] = support_[stencil.first + k];
    if (k <= cells) {
      takes_part[k] = lives(one) && lives(other);
      count += takes_part[k];
    } else {
      takes_part[k] = takes_part[one] || takes_part[other];
      neighbours += takes_part[k];
    }
  }
  const bool is_all_round = count == cells && neighbours == count;
  return is_all_round ? count > 2 : count > 1 && neighbours == count + 1;
}

void BendingStencils::update(const ActiveSet& active) {
  if (active.triangles == active_before_ && active.cracked == cracked_before_) {
    return;
  }
  active_before_ = active.triangles;
  cracked_before_ = active.cracked;
  std::vector<bool> is_used(sheet_->particles.local(), false);  // the stencil of each particle
  std::vector<bool> takes_part;
  for (Stencil& stencil : stencils_) {
    if (!find_part(stencil, active, takes_part)) {
      continue;
    }
    const auto before = takes_part_.begin() + static_cast<std::ptrdiff_t>(stencil.first);
    if (!std::equal(takes_part.begin(), takes_part.end(), before)) {
      std::copy(takes_part.begin(), takes_part.end(), before);
      fit(stencil);
      ++fits_;
    }
    is_used[stencil.centre] = stencil.is_determined;
  }
  // A cell's area goes to its lattice point, an eighth of it to each corner whose stencil it takes part in.
  std::vector<double> area(is_used.size(), 0);
  for (std::size_t cell = 0; cell < sheet_->cells.size(); ++cell) {
    const double eighth = cell_area_[cell] / 8;
    area[sheet_->lattice[cell]] += 4 * eighth;
    for (std::size_t k = 0; k < 4; ++k) {
      const PetscInt corner = sheet_->cells[cell][k];
      const bool takes_part =
          is_used[corner] && active.triangles[4 * cell + k] && active.triangles[4 * cell + (k + 3) % 4];
      area[takes_part ? corner : sheet_->lattice[cell]] += eighth;
    }
  }
  for (Stencil& stencil : stencils_) {
    stencil.area = is_used[stencil.centre] ? area[stencil.centre] : 0;
  }
}

void BendingStencils::fit(Stencil& stencil) {
  const bool is_lattice = sheet_->is_lattice[stencil.centre];
  if (!is_lattice) {  // two triangles a cell
    for (std::size_t t = stencil.first_triangle; t < stencil.last_triangle; ++t) {
      counts_[t] = takes_part(stencil.first + 1 + (t - stencil.first_triangle) / 2);
    }
  }
  std::fill_n(weights_.begin() + static_cast<std::ptrdiff_t>(stencil.first), stencil.last - stencil.first,
              Curvature3::Zero());
  stencil.rest.setZero();
  const Eigen::Vector3d centre = sheet_->rest.col(stencil.centre);
  const Eigen::Vector3d normal = area_vector(stencil, sheet_->rest.data()).normalized();
  const Eigen::Vector3d along = warp_.col(stencil.centre);
  const Eigen::Vector3d warp = (along - normal.dot(along) * normal).normalized();
  const Eigen::Vector3d weft = normal.cross(warp);
  const auto arm = [&](std::size_t point) -> Eigen::Vector3d { return sheet_->rest.col(points_[point]) - centre; };
  const auto in_plane = [&](std::size_t point) { return Eigen::Vector2d(warp.dot(arm(point)), weft.dot(arm(point))); };
  std::vector<std::size_t> used;  // the points that take part, but for the centre
  double squares = 0;
  for (std::size_t point = stencil.first + 1; point < stencil.last; ++point) {
    if (takes_part(point)) {
      used.push_back(point);
      squares += in_plane(point).squaredNorm();
    }
  }
  const double length = std::sqrt(squares / static_cast<double>(1 + used.size()));
  if (length == 0) {
    return;
  }
  Terms terms(5, used.size());
  for (std::size_t k = 0; k < used.size(); ++k) {
    terms.col(k) = terms_at(in_plane(used[k]) / length, stencil.is_clamped);
  }
  const bool is_fan = !is_lattice && !stencil.is_clamped && used.size() % 2 == 1;  // one neighbour more than cells
  stencil.is_determined = !is_fan || determine_surface(terms);
  const Terms inverse = pseudo_inverse(terms);
  for (std::size_t k = 0; k < used.size(); ++k) {
    const Curvature3 weight = inverse.col(k).tail<3>() / (length * length);
    weights_[used[k]] = weight;
    weights_[stencil.first] -= weight;
    stencil.rest += weight * normal.dot(arm(used[k]));
  }
}

}  // namespace pellicle::elastic
