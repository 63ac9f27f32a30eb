#include "elastic/bending_stencils.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <map>

namespace pellicle {
inline namespace elastic {

namespace {

/// Singular values below this share of the largest are taken for zero: terms that the points do not determine are left
/// out.
constexpr double negligible = 1e-6;

using Terms = Eigen::Matrix<double, 5, Eigen::Dynamic>;

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

BendingStencils::BendingStencils(const Sheet& sheet, const Weave& weave, const std::vector<bool>& clamped)
    : sheet_(&sheet),
      warp_(weave.warp),
      cell_area_(cell_areas(sheet)),
      stencil_of_(static_cast<std::size_t>(sheet.particles.local()), -1) {
  const auto particles = static_cast<std::size_t>(sheet.particles.local());
  std::vector<std::vector<PetscInt>> cells_at(particles);
  const CellSides beyond = sides_beyond(sheet);
  std::vector<bool> is_near(particles, false);  // itself or a neighbour is this rank's
  std::fill_n(is_near.begin(), sheet.particles.owned, true);
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    const auto& corners = sheet.cells[cell];
    for (std::size_t k = 0; k < 4; ++k) {
      cells_at[static_cast<std::size_t>(corners[k])].push_back(static_cast<PetscInt>(cell));
    }
  }
  for (const SpringSet& set : sheet.springs) {
    if (&set == &sheet.of(Colour::yellow)) {
      continue;
    }
    for (const auto& [a, b] : set.ends) {
      if (a < sheet.particles.owned || b < sheet.particles.owned) {
        is_near[static_cast<std::size_t>(a)] = true;
        is_near[static_cast<std::size_t>(b)] = true;
      }
    }
  }
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    if (is_near[static_cast<std::size_t>(sheet.lattice[cell])]) {
      add_lattice(static_cast<PetscInt>(cell), beyond);
    }
  }
  for (std::size_t i = 0; i < particles; ++i) {
    if (!sheet.is_lattice[i]) {
      // Whether the corners of a near lattice point have a stencil must be known, too.
      add_corner(static_cast<PetscInt>(i), cells_at[i], clamped[i]);
    }
  }
  fitted_.resize(stencils_.size());
  weights_.assign(points_.size(), Curvature3::Zero());
  update(Living(sheet));
}

void BendingStencils::begin_stencil(PetscInt centre) {
  stencil_of_[static_cast<std::size_t>(centre)] = static_cast<PetscInt>(stencils_.size());
  Stencil stencil;
  stencil.centre = centre;
  stencil.first = points_.size();
  stencil.first_triangle = triangles_.size();
  stencils_.push_back(stencil);
  add_point(centre, {-1, -1});
}

void BendingStencils::add_point(PetscInt particle, Support support) {
  points_.push_back(particle);
  support_.push_back(support);
}

void BendingStencils::end_stencil() {
  stencils_.back().last = points_.size();
  stencils_.back().last_triangle = triangles_.size();
}

void BendingStencils::add_lattice(PetscInt cell, const CellSides& beyond) {
  const auto c = static_cast<std::size_t>(cell);
  begin_stencil(sheet_->lattice[c]);
  for (std::size_t k = 0; k < 4; ++k) {
    add_point(sheet_->cells[c][k], {-1, -1});
    const PetscInt other = beyond[c][k];
    if (other >= 0) {
      add_point(sheet_->lattice[static_cast<std::size_t>(other / 4)], {4 * cell + static_cast<PetscInt>(k), other});
    }
    triangle_number_.push_back(4 * cell + static_cast<PetscInt>(k));
    triangles_.push_back(sheet_->triangles[4 * c + k]);
  }
  end_stencil();
}

void BendingStencils::add_corner(PetscInt corner, const std::vector<PetscInt>& cells, bool is_clamped) {
  std::map<PetscInt, int> cells_at_neighbour;
  for (const PetscInt cell : cells) {
    const auto& corners = sheet_->cells[static_cast<std::size_t>(cell)];
    const auto k = static_cast<std::size_t>(std::find(corners.begin(), corners.end(), corner) - corners.begin());
    ++cells_at_neighbour[corners[(k + 1) % 4]];
    ++cells_at_neighbour[corners[(k + 3) % 4]];
  }
  const bool is_inside = cells.size() > 2 && std::all_of(cells_at_neighbour.begin(), cells_at_neighbour.end(),
                                                         [](const auto& count) { return count.second == 2; });
  if (!is_inside && !is_clamped) {
    return;
  }
  begin_stencil(corner);
  stencils_.back().is_clamped = !is_inside;
  for (const PetscInt cell : cells) {
    const auto c = static_cast<std::size_t>(cell);
    const auto& corners = sheet_->cells[c];
    const auto k = static_cast<std::size_t>(std::find(corners.begin(), corners.end(), corner) - corners.begin());
    add_point(sheet_->lattice[c], {-1, -1});
    for (const std::size_t triangle : {4 * c + k, 4 * c + (k + 3) % 4}) {
      triangle_number_.push_back(static_cast<PetscInt>(triangle));
      triangles_.push_back(sheet_->triangles[triangle]);
    }
  }
  for (const auto& [neighbour, count] : cells_at_neighbour) {
    add_point(neighbour, {-1, -1});
  }
  end_stencil();
}

void BendingStencils::update(const Living& living) {
  if (living.triangles == living_before_ && living.cracked == cracked_before_) {
    return;
  }
  living_before_ = living.triangles;
  cracked_before_ = living.cracked;
  const auto lives = [&living](PetscInt triangle) {
    return triangle < 0 || living.triangles[static_cast<std::size_t>(triangle)];
  };
  std::vector<bool> takes_part;
  for (std::size_t s = 0; s < stencils_.size(); ++s) {
    Stencil& stencil = stencils_[s];
    const bool is_whole =
        std::all_of(triangle_number_.begin() + static_cast<std::ptrdiff_t>(stencil.first_triangle),
                    triangle_number_.begin() + static_cast<std::ptrdiff_t>(stencil.last_triangle), lives);
    stencil.area = is_whole ? 1 : 0;
    if (!is_whole) {
      continue;
    }
    takes_part.clear();
    for (std::size_t p = stencil.first; p < stencil.last; ++p) {
      const PetscInt side = support_[p][0];
      takes_part.push_back(lives(side) && lives(support_[p][1]) &&
                           (side < 0 || !living.cracked[static_cast<std::size_t>(side)]));
    }
    if (takes_part != fitted_[s]) {
      fit(stencil, takes_part);
      ++fits_;
      fitted_[s] = takes_part;
    }
  }
  const auto is_used = [this](PetscInt particle) {
    const PetscInt number = stencil_of_[static_cast<std::size_t>(particle)];
    return number >= 0 && stencils_[static_cast<std::size_t>(number)].area > 0;
  };
  // A cell's area goes to its lattice point, an eighth of it to each corner that has a stencil.
  std::vector<double> area(stencil_of_.size(), 0);
  for (std::size_t cell = 0; cell < sheet_->cells.size(); ++cell) {
    const double eighth = cell_area_[cell] / 8;
    area[static_cast<std::size_t>(sheet_->lattice[cell])] += 4 * eighth;
    for (const PetscInt corner : sheet_->cells[cell]) {
      area[static_cast<std::size_t>(is_used(corner) ? corner : sheet_->lattice[cell])] += eighth;
    }
  }
  for (Stencil& stencil : stencils_) {
    stencil.area *= area[static_cast<std::size_t>(stencil.centre)];
  }
}

void BendingStencils::fit(Stencil& stencil, const std::vector<bool>& takes_part) {
  const Eigen::Vector3d centre = sheet_->rest.col(stencil.centre);
  const Eigen::Vector3d normal = area_vector(stencil, sheet_->rest).normalized();
  const Eigen::Vector3d along = warp_.col(stencil.centre);
  const Eigen::Vector3d warp = (along - normal.dot(along) * normal).normalized();
  const Eigen::Vector3d weft = normal.cross(warp);
  const std::size_t count = stencil.last - stencil.first;
  Eigen::Matrix2Xd r(2, static_cast<Eigen::Index>(count));
  std::vector<Eigen::Index> used;
  for (std::size_t p = 0; p < count; ++p) {
    const Eigen::Vector3d arm = sheet_->rest.col(points_[stencil.first + p]) - centre;
    r.col(static_cast<Eigen::Index>(p)) << warp.dot(arm), weft.dot(arm);
    if (p > 0 && takes_part[p]) {
      used.push_back(static_cast<Eigen::Index>(p));
    }
  }
  std::fill_n(weights_.begin() + static_cast<std::ptrdiff_t>(stencil.first), count, Curvature3::Zero());
  stencil.rest.setZero();
  const double length = std::sqrt(r.squaredNorm() / static_cast<double>(count));
  if (length == 0) {
    return;
  }
  r /= length;
  Terms terms(5, static_cast<Eigen::Index>(used.size()));
  for (std::size_t row = 0; row < used.size(); ++row) {
    const double x = r(0, used[row]);
    const double y = r(1, used[row]);
    const double tilt = stencil.is_clamped ? 0 : 1;
    terms.col(static_cast<Eigen::Index>(row)) << tilt * x, tilt * y, x * x / 2, x * y, y * y / 2;
  }
  const Terms inverse = pseudo_inverse(terms) / (length * length);
  for (std::size_t row = 0; row < used.size(); ++row) {
    const Curvature3 weight = inverse.col(static_cast<Eigen::Index>(row)).tail<3>();
    const std::size_t point = stencil.first + static_cast<std::size_t>(used[row]);
    weights_[point] = weight;
    weights_[stencil.first] -= weight;
    stencil.rest += weight * normal.dot(sheet_->rest.col(points_[point]) - centre);
  }
}

}  // namespace elastic
}  // namespace pellicle
