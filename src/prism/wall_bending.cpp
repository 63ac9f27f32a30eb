#include "prism/wall_bending.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/log_event.h"
#include "geometry/cross_matrix.h"
#include "prism/material.h"

namespace pellicle::prism {

namespace {

/// Share of the area of the triangles laid flat below which |N| of a sharp fold gives no good normal.
constexpr double sharp = 0.1;
constexpr double flatness = 1 / (1 + sharp * sharp);  // so that a flat wall has a normal of length 1

Eigen::Map<const Eigen::Vector3d> position(const double* x, PetscInt i) {
  return Eigen::Map<const Eigen::Vector3d>(x + 3 * i);
}

/// The plate's stiffness by b for a metric a, times D: T^T [1 0 nu; 0 1-nu 0; nu 0 1] T, where T b are the curvatures
/// (11, sqrt(2) 12, 22) in orthonormal axes of the present surface.
Eigen::Matrix3d stiffness_by_metric(const Eigen::Matrix2d& a, double poisson) {
  const Eigen::Matrix2d upper = a.llt().matrixU();
  const Eigen::Matrix2d l = upper.inverse();  // a^-1 = l l^T
  const double l11 = l(0, 0), l12 = l(0, 1), l22 = l(1, 1);
  const double root = std::sqrt(2.0);
  Eigen::Matrix3d map;
  map << l11 * l11, 0, 0,                     //
      root * l11 * l12, root * l11 * l22, 0,  //
      l12 * l12, 2 * l12 * l22, l22 * l22;
  Eigen::Matrix3d plate;
  plate << 1, 0, poisson, 0, 1 - poisson, 0, poisson, 0, 1;
  return map.transpose() * plate * map;
}

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Sets a row of left^T right, both with three rows, from a column on.
void set_products(const Rows& left, const Rows& right, Eigen::Index row, Eigen::Index from, Eigen::Index end,
                  double* result) {
  const double l0 = left(0, row), l1 = left(1, row), l2 = left(2, row);
  const double* r0 = right.row(0).data();
  const double* r1 = right.row(1).data();
  const double* r2 = right.row(2).data();
  for (Eigen::Index c = from; c < end; ++c) {
    result[c] = l0 * r0[c] + l1 * r1[c] + l2 * r2[c];
  }
}

/// Adds a row of turns^T twists + moment tilts.
void add_moments(const Rows& turns, const Rows& twists, const Rows& tilts, double moment, Eigen::Index row,
                 Eigen::Index from, Eigen::Index end, double* result) {
  const double l0 = turns(0, row), l1 = turns(1, row), l2 = turns(2, row);
  const double* r0 = twists.row(0).data();
  const double* r1 = twists.row(1).data();
  const double* r2 = twists.row(2).data();
  const double* r3 = tilts.row(row % 3).data();
  for (Eigen::Index c = from; c < end; ++c) {
    result[c] += l0 * r0[c] + l1 * r1[c] + l2 * r2[c] + moment * r3[c];
  }
}

/// A metric whose stretches are bounded away from zero: at least 0.1.
Eigen::Matrix2d bounded(const Eigen::Matrix2d& a) {
  constexpr double least = 0.1 * 0.1;
  if (a.trace() > 2 * least && a.determinant() > least * a.trace()) {
    return a;  // both eigenvalues are larger
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(a);
  return axes.eigenvectors() * axes.eigenvalues().cwiseMax(least).asDiagonal() * axes.eigenvectors().transpose();
}

}  // namespace

WallBending::WallBending(const PrismElements& elements, const Projectors& projectors, const std::vector<bool>& clamped)
    : elements_(elements),
      stencils_(plate_stencils(elements.membrane(), projectors, clamped)),
      plates_(stencils_.stencils.size()),
      beyond_(stencils_.reach, 3) {
  const Wall& wall = elements.wall();
  for (std::size_t e = 0; e < wall.rest.size(); ++e) {
    const auto [mu, lambda] = small_strain_moduli(wall.material_of(e));
    const double poisson = wall.rule == ThicknessRule::incompressible ? 0.5 : lambda / (2 * (lambda + mu));
    poisson_.push_back(poisson);
    stiffness_.push_back(mu / (6 * (1 - poisson)));
  }
  for (const PlateStencil& stencil : stencils_.stencils) {
    most_points_ = std::max(most_points_, stencil.last - stencil.first);
  }
}

std::vector<WallBending::Plate> WallBending::plates(const Field& start,
                                                    const std::vector<double>& thickness_ratio) const {
  const Membrane& membrane = elements_.membrane();
  const Wall& wall = elements_.wall();
  const std::vector<PlateStencil>& stencils = stencils_.stencils;
  std::vector<char> is_used(membrane.particles.local(), 0);
  for (std::size_t s = 0; s < stencils_.owned; ++s) {
    const std::vector<PlateCorner>& corners = stencils_.corners[s];
    is_used[stencils[s].centre] = std::all_of(corners.begin(), corners.end(), [this](const PlateCorner& corner) {
      return elements_.stiffness(corner.element) > 0;
    });
  }
  update_ghosts(membrane.particles, is_used);

  // Data that owners send to ghosts of a vertex: the upper half of the stiffness, s, the reference.
  Field known(stencils_.reach, 8);
  for (std::size_t s = 0; s < stencils_.owned; ++s) {
    const PetscInt centre = stencils[s].centre;
    if (is_used[centre] == 0) {
      continue;
    }
    double area = 0, rigidity = 0, poisson = 0, shrinkage = 0, reference = 0;
    Eigen::Matrix2d a = Eigen::Matrix2d::Zero();
    for (const PlateCorner& corner : stencils_.corners[s]) {
      const std::size_t e = corner.element;
      const std::array<PetscInt, 3>& triangle = membrane.triangles[e];
      const std::size_t k = std::find(triangle.begin(), triangle.end(), centre) - triangle.begin();
      Eigen::Matrix<double, 3, 2> edges;
      edges << start.vector(triangle[(k + 1) % 3]) - start.vector(centre),
          start.vector(triangle[(k + 2) % 3]) - start.vector(centre);
      const Eigen::Matrix<double, 3, 2> gradient = edges * corner.inverse;
      const double undeformed = wall.rest[e].area;
      a += undeformed * gradient.transpose() * gradient;
      area += undeformed;
      shrinkage += undeformed * std::sqrt(elements_.rest(e).area / undeformed);
      reference += edges.col(0).cross(edges.col(1)).norm();
      const int sharers = is_used[triangle[0]] + is_used[triangle[1]] + is_used[triangle[2]];
      const double fraction = elements_.stiffness(e) * stiffness_[e] *
                              std::pow(thickness_ratio[e] * wall.thickness[e], 3) * undeformed / sharers;
      rigidity += fraction;
      poisson += fraction * poisson_[e];
    }
    a = bounded(a / area);
    const Eigen::Matrix3d stiffness =
        rigidity * std::sqrt(a.determinant()) * stiffness_by_metric(a, poisson / rigidity);
    known.values().col(centre) << stiffness(0, 0), stiffness(0, 1), stiffness(0, 2), stiffness(1, 1), stiffness(1, 2),
        stiffness(2, 2), shrinkage / area, stencils[s].flatness * reference;
  }
  known.update_ghosts();
  std::vector<Plate> result(stencils.size());
  for (std::size_t s = 0; s < stencils.size(); ++s) {
    const Eigen::Matrix<double, 8, 1> own = known.values().col(stencils[s].centre);
    Plate& plate = result[s];
    plate.stiffness << own[0], own[1], own[2], own[1], own[3], own[4], own[2], own[4], own[5];
    plate.target = own[6] * stencils[s].rest;
    plate.reference = own[7];
  }
  return result;
}

/// Positions of the vertices in the stencils' reach. Collective.
const double* WallBending::reach(const Field& x) const {
  if (!stencils_.goes_beyond) {
    return x.data();
  }
  beyond_.values().leftCols(x.values().cols()) = x.values();
  beyond_.update_ghosts();
  return beyond_.data();
}

WallBending::State WallBending::state(const PlateStencil& stencil, const Plate& plate, const double* x) const {
  const Eigen::Vector3d centre = position(x, stencil.centre);
  State state;
  state.bent.setZero();
  state.area.setZero();
  Eigen::Vector3d before = Eigen::Vector3d::Zero();  // from the vertex to the point before
  if (stencil.is_closed) {
    before = position(x, stencils_.points[stencil.ring_end - 1]) - centre;
  }
  for (Eigen::Index p = stencil.first + 1; p < stencil.last; ++p) {
    const Eigen::Vector3d arm = position(x, stencils_.points[p]) - centre;
    state.bent += arm * stencils_.weights[p].transpose();
    if (p < stencil.ring_end) {
      state.area += before.cross(arm);
      before = arm;
    }
  }
  if (stencil.has_fixed_normal) {
    state.length = 0;
    state.normal = stencil.normal;
  } else {
    state.area -= stencil.mirror.dot(state.area) * stencil.mirror;
    const double kept = sharp * plate.reference;
    state.length = std::sqrt(flatness * (state.area.squaredNorm() + kept * kept));
    state.normal = state.area / state.length;
  }
  state.moments = plate.stiffness * (state.bent.transpose() * state.normal - plate.target);
  return state;
}

/// dN = sum_p dx_p x turning_p, without the mirror image.
void WallBending::find_turning(const PlateStencil& stencil, const double* x, Eigen::Matrix3Xd& turning) const {
  const Eigen::Index polygon = stencil.first + (stencil.is_closed ? 1 : 0);
  turning.setZero();
  for (Eigen::Index p = polygon; p < stencil.ring_end; ++p) {
    const Eigen::Index next = p + 1 < stencil.ring_end ? p + 1 : polygon;
    const Eigen::Index previous = p > polygon ? p - 1 : stencil.ring_end - 1;
    turning.col(p - stencil.first) = position(x, stencils_.points[next]) - position(x, stencils_.points[previous]);
  }
}

double WallBending::sum_of(const std::vector<Plate>& plates, const Field& x) const {
  static const PetscLogEvent event = log_event("BendEnergy");
  const LogScope scope(event, 300.0 * static_cast<double>(stencils_.owned));
  const double* positions = reach(x);
  double sum = 0;
  for (std::size_t s = 0; s < stencils_.owned; ++s) {
    if (plates[s].reference > 0) {
      const State at = state(stencils_.stencils[s], plates[s], positions);
      sum += at.energy(plates[s]);
    }
  }
  return sum;
}

double WallBending::add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  static const PetscLogEvent event = log_event("BendGradient");
  const LogScope scope(event, 600.0 * static_cast<double>(stencils_.stencils.size()));
  const double* positions = reach(x);
  const Eigen::Index owned = elements_.membrane().particles.owned;
  Eigen::Matrix3Xd turning(3, most_points_);
  double sum = 0;
  for (std::size_t s = 0; s < stencils_.stencils.size(); ++s) {
    if (plates_[s].reference == 0) {
      continue;
    }
    const PlateStencil& stencil = stencils_.stencils[s];
    const State at = state(stencil, plates_[s], positions);
    sum += s < stencils_.owned ? at.energy(plates_[s]) : 0;
    Eigen::Vector3d by_area = Eigen::Vector3d::Zero();
    if (!stencil.has_fixed_normal) {
      const Eigen::Vector3d by_normal = at.bent * at.moments;
      by_area = (by_normal - flatness * at.normal.dot(by_normal) * at.normal) / at.length;
      by_area -= stencil.mirror.dot(by_area) * stencil.mirror;
      find_turning(stencil, positions, turning);
    }
    for (Eigen::Index p = stencil.first; p < stencil.last; ++p) {
      const PetscInt i = stencils_.points[p];
      if (i < owned) {
        gradient.col(i) += at.moments.dot(stencils_.weights[p]) * at.normal;
        if (!stencil.has_fixed_normal) {
          gradient.col(i) += turning.col(p - stencil.first).cross(by_area);
        }
      }
    }
  }
  return sum;
}

std::vector<VertexPair> WallBending::pattern() const {
  const PetscInt owned = elements_.membrane().particles.owned;
  std::vector<VertexPair> pairs;
  for (const PlateStencil& stencil : stencils_.stencils) {
    for (Eigen::Index p = stencil.first; p < stencil.last; ++p) {
      const PetscInt row = stencils_.points[p];
      if (row >= owned) {
        continue;
      }
      for (Eigen::Index q = stencil.first; q < stencil.last; ++q) {
        pairs.push_back({row, stencils_.reach.to_global(stencils_.points[q])});
      }
    }
  }
  return pairs;
}

void WallBending::update_hessian(const Field& x, double psd_blend) {
  const double* positions = reach(x);
  linearised_ = Eigen::Map<const Eigen::Matrix3Xd>(positions, 3, stencils_.reach.local());
  kept_moments_ = 1 - psd_blend;
}

void WallBending::add_hessian(const HessianBlocks& blocks) const {
  static const PetscLogEvent event = log_event("BendHessian");
  const LogScope scope(event, 4000.0 * static_cast<double>(stencils_.stencils.size()));
  const PetscInt owned = elements_.membrane().particles.owned;
  const double* x = linearised_.data();
  // By the coordinates of all points, with S_p dx_p = dx_p x turning_p, dN = sum_p S_p dx_p:
  Rows bends(3, 3 * most_points_);   // db
  Rows stiff(3, 3 * most_points_);   // the stiffness times it
  Rows turns(3, 3 * most_points_);   // dN
  Rows tilts(3, 3 * most_points_);   // dn
  Rows twists(3, 3 * most_points_);  // m.d2n/dN2 dN + dn/dN^T dm', with m' = m.w of a point
  Rows sum(3 * most_points_, 3 * most_points_);
  Eigen::VectorXd moment(most_points_);  // m'
  Eigen::Matrix3Xd turning(3, most_points_);
  std::vector<std::size_t> first_pair(most_points_);
  std::size_t pair = 0;
  for (std::size_t s = 0; s < stencils_.stencils.size(); ++s) {
    const PlateStencil& stencil = stencils_.stencils[s];
    const Eigen::Index count = stencil.last - stencil.first;
    const auto is_row = [&](Eigen::Index p) { return stencils_.points[stencil.first + p] < owned; };
    for (Eigen::Index p = 0; p < count; ++p) {
      first_pair[p] = pair;
      pair += is_row(p) ? count : 0;
    }
    if (plates_[s].reference == 0) {
      continue;
    }
    State at = state(stencil, plates_[s], x);
    at.moments *= kept_moments_;
    const bool turns_normal = !stencil.has_fixed_normal;
    const bool has_moments = kept_moments_ > 0 && turns_normal;
    Eigen::Matrix3d by_area = Eigen::Matrix3d::Zero();  // dn/dN
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();   // v.d2n/dN2 with v = sum_k m_k B_k
    Eigen::Vector3d force = Eigen::Vector3d::Zero();    // v.dn/dN
    if (turns_normal) {
      find_turning(stencil, x, turning);
      const Eigen::Matrix3d kept = Eigen::Matrix3d::Identity() - stencil.mirror * stencil.mirror.transpose();
      const Eigen::Vector3d& n = at.normal;
      by_area = (Eigen::Matrix3d::Identity() - flatness * n * n.transpose()) / at.length * kept;
      const Eigen::Vector3d v = at.bent * at.moments;
      force = by_area.transpose() * v;
      const Eigen::Matrix3d crossed = n * v.transpose();
      second = -flatness / (at.length * at.length) *
               (crossed + crossed.transpose() - 3 * flatness * v.dot(n) * n * n.transpose() +
                v.dot(n) * Eigen::Matrix3d::Identity());
      second = (kept * second * kept).eval();
    }
    const Eigen::Matrix3d bent_by_area = at.bent.transpose() * by_area;
    for (Eigen::Index p = 0; p < count; ++p) {
      const PlateCurvature& weight = stencils_.weights[stencil.first + p];
      Eigen::Matrix3d bend = weight * at.normal.transpose();
      if (turns_normal) {
        const Eigen::Matrix3d turn = -cross_matrix(turning.col(p));
        bend += bent_by_area * turn;
        if (has_moments) {
          moment[p] = at.moments.dot(weight);
          turns.middleCols<3>(3 * p) = turn;
          tilts.middleCols<3>(3 * p) = by_area * turn;
          twists.middleCols<3>(3 * p) = second * turn + moment[p] * by_area.transpose();
        }
      }
      bends.middleCols<3>(3 * p) = bend;
      stiff.middleCols<3>(3 * p) = plates_[s].stiffness * bend;
    }

    // The upper half of bends^T stiff + turns^T twists + moment tilts, and the second derivative of N.
    const Eigen::Index end = 3 * count;
    for (Eigen::Index row = 0; row < end; ++row) {
      const Eigen::Index from = row - row % 3;
      set_products(bends, stiff, row, from, end, sum.row(row).data());
      if (has_moments) {
        add_moments(turns, twists, tilts, moment[row / 3], row, from, end, sum.row(row).data());
      }
    }
    if (has_moments) {
      const Eigen::Matrix3d turned = cross_matrix(force);
      const Eigen::Index ring = stencil.ring_end - stencil.first;
      const Eigen::Index polygon = stencil.is_closed ? 1 : 0;
      for (Eigen::Index p = polygon; p + 1 < ring; ++p) {
        sum.block<3, 3>(3 * p, 3 * p + 3) -= turned;
      }
      sum.block<3, 3>(3 * polygon, 3 * (ring - 1)) += turned;
    }
    for (Eigen::Index p = 0; p < count; ++p) {
      for (Eigen::Index q = p; q < count; ++q) {
        const Eigen::Matrix3d block = sum.block<3, 3>(3 * p, 3 * q);
        if (is_row(p)) {
          blocks.add(first_pair[p] + q, block);
        }
        if (q > p && is_row(q)) {
          blocks.add(first_pair[q] + p, block.transpose());
        }
      }
    }
  }
}

}  // namespace pellicle::prism
