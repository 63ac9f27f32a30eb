#include "elastic/in_plane_potential.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/log_event.h"
#include "elastic/sheet_geometry.h"
#include "geometry/pressure_load.h"
#include "surface/membrane.h"

namespace pellicle::elastic {

namespace {

constexpr double share_of_triangles = 1.0 / 3;  // c over the least eigenvalue of C

constexpr std::size_t lanes = CellTerms::lanes;
constexpr std::size_t edges = CellTerms::edges;
constexpr auto ends = CellTerms::ends;

/// The edges of triangle t of a cell: its side, that from the first corner to the lattice point, that from the second.
constexpr std::array<std::size_t, 3> edges_of_triangle(std::size_t t) { return {t, 4 + t, 4 + (t + 1) % 4}; }

using OfEdges = Eigen::Matrix<double, edges, 1>;
using Arms = Eigen::Matrix<double, 3, edges>;

Arms arms_of(const std::array<PetscInt, 5>& points, const double* x) {
  const auto place = [&](std::size_t k) { return Eigen::Map<const Eigen::Vector3d>(x + 3 * points[k]); };
  Arms arms;
  for (std::size_t e = 0; e < edges; ++e) {
    arms.col(e) = place(ends[e][1]) - place(ends[e][0]);
  }
  return arms;
}

OfEdges squares_of(const Arms& arms) { return arms.colwise().squaredNorm(); }

Eigen::Vector3d values_of(const OfEdges& values, std::size_t triangle) {
  const auto [side, first, second] = edges_of_triangle(triangle);
  return {values[side], values[first], values[second]};
}

/// The derivative of Green's strain (E11, E22, sqrt(2) E12), by axes along warp and weft, by the squared lengths of
/// edges_of_triangle. @param side, arm undeformed: the side, and from its first corner to the lattice point
Eigen::Matrix3d strain_by_squares(const Eigen::Vector3d& side, const Eigen::Vector3d& arm,
                                  const Eigen::Vector3d& warp) {
  const Eigen::Vector3d normal = side.cross(arm).normalized();
  const Eigen::Vector3d along = (warp - normal.dot(warp) * normal).normalized();
  const Eigen::Vector3d across = normal.cross(along);
  Eigen::Matrix2d undeformed;
  undeformed << side.dot(along), arm.dot(along), side.dot(across), arm.dot(across);
  const Eigen::Matrix2d r = undeformed.inverse();  // E = r^T (a - a0) r / 2 with the metric a of side and arm
  const double root = std::sqrt(2.0);
  Eigen::Matrix3d by_metric;
  for (int k = 0; k < 2; ++k) {
    by_metric.row(k) << r(0, k) * r(0, k), 2 * r(0, k) * r(1, k), r(1, k) * r(1, k);
  }
  by_metric.row(2) << root * r(0, 0) * r(0, 1), root * (r(0, 0) * r(1, 1) + r(1, 0) * r(0, 1)),
      root * r(1, 0) * r(1, 1);
  Eigen::Matrix3d metric_by_squares;
  metric_by_squares << 1, 0, 0, 0.5, 0.5, -0.5, 0, 1, 0;
  return by_metric * metric_by_squares / 2;
}

/// C of a material in plane stress [N/m]. Poisson's ratio is that of both directions, the geometric mean of the two.
Eigen::Matrix3d plane_stiffness(const Stiffness& stiffness, double tensile_factor, double shear_factor) {
  const double nu = stiffness.poisson_ratio;
  const double normal = tensile_factor / (1 - nu * nu);
  const auto& [warp, weft] = stiffness.tensile;
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  result(0, 0) = normal * warp;
  result(1, 1) = normal * weft;
  result(0, 1) = result(1, 0) = nu * normal * std::sqrt(warp * weft);
  result(2, 2) = 2 * shear_factor * stiffness.shear;
  return result;
}

/// A stress (11, 22, sqrt(2) 12) without its compressive principal value.
Eigen::Vector3d without_compression(const Eigen::Vector3d& stress) {
  const double mean = (stress[0] + stress[1]) / 2;
  const double radius = std::hypot((stress[0] - stress[1]) / 2, stress[2] / std::sqrt(2.0));
  const double smaller = mean - radius;
  const double larger = mean + radius;
  if (smaller >= 0) {
    return stress;
  }
  if (larger <= 0) {
    return Eigen::Vector3d::Zero();
  }
  return larger / (larger - smaller) * (stress - smaller * Eigen::Vector3d(1, 1, 0));
}

}  // namespace

InPlanePotential::InPlanePotential(const Sheet& sheet, const Stiffness& stiffness, const Eigen::Vector3d& warp,
                                   const MaterialFactors& factors)
    : sheet_(sheet), hessian_((sheet.cells.size() + lanes - 1) / lanes, CellTerms{}) {
  const Eigen::Matrix3Xd warps = warp_of(sheet, warp);
  for (std::size_t c = 0; c < sheet.cells.size(); ++c) {
    Cell& cell = cells_.emplace_back();
    std::copy(sheet.cells[c].begin(), sheet.cells[c].end(), cell.points.begin());
    cell.points[4] = sheet.lattice[c];
    const Arms arms = arms_of(cell.points, sheet.rest.data());
    cell.rest = squares_of(arms);
    for (std::size_t t = 0; t < 4; ++t) {
      cell.triangles[t].strain = strain_by_squares(arms.col(t), arms.col(4 + t), warps.col(cell.points[4]));
      cell.triangles[t].area = arms.col(t).cross(arms.col(4 + t)).norm() / 2;
    }
    cell.stiffness = plane_stiffness(stiffness, mean(cell, factors.tensile), mean(cell, factors.shear));
    cell.least = share_of_triangles *
                 std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(cell.stiffness).eigenvalues().minCoeff());
    for (std::size_t k = 0; k < cell.points.size(); ++k) {
      hessian_[c / lanes].vertex[k][c % lanes] = cell.points[k];
    }
  }
}

/// Mean over a cell of values of the particles, half of it of the lattice point; 1 if there are none.
double InPlanePotential::mean(const Cell& cell, const std::vector<double>& values) {
  const auto& [a, b, c, d, lattice] = cell.points;
  return values.empty() ? 1 : (values[a] + values[b] + values[c] + values[d]) / 8 + values[lattice] / 2;
}

void InPlanePotential::begin_step(const ActiveSet& active, const Field& start, const Input& input) {
  const bool has_other_viscosity = viscosity_ != input.damping_over_step;
  viscosity_ = input.damping_over_step;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    Cell& cell = cells_[c];
    const double factor = mean(cell, input.factor);
    bool is_other = has_other_viscosity || factor != cell.factor;
    cell.factor = factor;
    for (std::size_t t = 0; t < 4; ++t) {
      const auto& [first, second, lattice] = sheet_.triangles[4 * c + t];
      const double scale = (input.shrinkage[first] + input.shrinkage[second]) / 4 + input.shrinkage[lattice] / 2;
      const double area = active.triangles[4 * c + t] ? cell.triangles[t].area * scale * scale : 0;
      is_other = is_other || area != cell.area[t] || scale * scale != cell.squared_scale[t];
      cell.area[t] = area;
      cell.squared_scale[t] = scale * scale;
    }
    if (is_other) {
      set_coupling(c);
    }
    if (viscosity_ > 0) {
      cell.start = squares_of(arms_of(cell.points, start.data()));
    }
  }
}

/// Sets the coupling of a cell's edges: four times the second derivative of the energy by their squared lengths.
void InPlanePotential::set_coupling(std::size_t number) {
  const Cell& cell = cells_[number];
  Eigen::Matrix<double, edges, edges> second = Eigen::Matrix<double, edges, edges>::Zero();
  if (const double area = area_of(cell); area > 0) {
    Eigen::Matrix<double, 3, edges> mean = Eigen::Matrix<double, 3, edges>::Zero();  // A dm/dq
    for (std::size_t t = 0; t < 4; ++t) {
      const Eigen::Matrix3d strain = cell.triangles[t].strain / cell.squared_scale[t];
      const auto of = edges_of_triangle(t);
      const Eigen::Matrix3d own = cell.area[t] * cell.least * strain.transpose() * strain;
      for (std::size_t i = 0; i < 3; ++i) {
        mean.col(of[i]) += cell.area[t] * strain.col(i);
        for (std::size_t j = 0; j < 3; ++j) {
          second(of[i], of[j]) += own(i, j);
        }
      }
    }
    second += mean.transpose() * (cell.stiffness - cell.least * Eigen::Matrix3d::Identity()) * mean / area;
    second *= 4 * cell.factor * (1 + viscosity_);
  }
  std::size_t k = 0;
  for (std::size_t e = 0; e < edges; ++e) {
    for (std::size_t f = e; f < edges; ++f) {
      hessian_[number / lanes].coupling[k++][number % lanes] = second(e, f);
    }
  }
}

double InPlanePotential::area_of(const Cell& cell) { return cell.area[0] + cell.area[1] + cell.area[2] + cell.area[3]; }

/// @param strain_of gives the strain of a triangle
template <class StrainOf>
InPlanePotential::State InPlanePotential::state_of(const Cell& cell, const StrainOf& strain_of) {
  std::array<Mandel, 4> strain;
  Mandel mean = Mandel::Zero();
  for (std::size_t t = 0; t < 4; ++t) {
    strain[t] = strain_of(t);
    mean += cell.area[t] * strain[t];
  }
  mean /= area_of(cell);
  const Mandel common = cell.factor * (cell.stiffness * mean - cell.least * mean);
  State state;
  for (std::size_t t = 0; t < 4; ++t) {
    state.stress[t] = common + cell.factor * cell.least * strain[t];
    state.energy += cell.area[t] * state.stress[t].dot(strain[t]) / 2;
  }
  return state;
}

InPlanePotential::State InPlanePotential::elastic_state(const Cell& cell, const OfEdges& squares) const {
  return state_of(cell, [&](std::size_t t) -> Mandel {
    return cell.triangles[t].strain * (values_of(squares, t) / cell.squared_scale[t] - values_of(cell.rest, t));
  });
}

InPlanePotential::State InPlanePotential::state(const Cell& cell, const OfEdges& squares) const {
  State state = elastic_state(cell, squares);
  if (viscosity_ > 0) {
    const OfEdges change = squares - cell.start;
    const State viscous = state_of(cell, [&](std::size_t t) -> Mandel {
      return cell.triangles[t].strain * values_of(change, t) / cell.squared_scale[t];
    });
    for (std::size_t t = 0; t < 4; ++t) {
      state.stress[t] += viscosity_ * viscous.stress[t];
    }
    state.energy += viscosity_ * viscous.energy;
  }
  return state;
}

/// The derivative of the energy by the squared lengths of the edges [N/m].
InPlanePotential::OfEdges InPlanePotential::by_squares(const Cell& cell, const std::array<Mandel, 4>& stress) {
  OfEdges result = OfEdges::Zero();
  for (std::size_t t = 0; t < 4; ++t) {
    const Eigen::Vector3d own =
        cell.area[t] / cell.squared_scale[t] * (cell.triangles[t].strain.transpose() * stress[t]);
    const auto of = edges_of_triangle(t);
    for (std::size_t i = 0; i < 3; ++i) {
      result[of[i]] += own[i];
    }
  }
  return result;
}

double InPlanePotential::elastic_energy(const Field& x) const {
  double sum = 0;
  for (PetscInt c = 0; c < sheet_.elements.owned; ++c) {
    if (const Cell& cell = cells_[c]; area_of(cell) > 0) {
      sum += elastic_state(cell, squares_of(arms_of(cell.points, x.data()))).energy;
    }
  }
  return sum;
}

std::vector<Eigen::Matrix3d> InPlanePotential::stress(const Field& x) const {
  std::vector<Eigen::Matrix3d> result;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const Cell& cell = cells_[c];
    Eigen::Matrix3d& sum = result.emplace_back(Eigen::Matrix3d::Zero());
    const Arms arms = arms_of(cell.points, x.data());
    double area = 0;
    for (std::size_t t = 0; t < 4; ++t) {
      area += cell.area[t] > 0 ? arms.col(t).cross(arms.col(4 + t)).norm() / 2 : 0;
    }
    if (area > 0) {  // A small strain d changes the square of an edge by 2 edge.d edge, and U by area stress:d.
      const OfEdges slope = by_squares(cell, state(cell, squares_of(arms)).stress);
      sum = 2 / area * arms * slope.asDiagonal() * arms.transpose();
    }
  }
  return result;
}

double InPlanePotential::value(const Field& x) const {
  static const PetscLogEvent event = log_event("InPlaneEnergy");
  const LogScope scope(event, 250.0 * static_cast<double>(sheet_.elements.owned));
  double sum = 0;
  for (PetscInt c = 0; c < sheet_.elements.owned; ++c) {
    if (const Cell& cell = cells_[c]; area_of(cell) > 0) {
      sum += state(cell, squares_of(arms_of(cell.points, x.data()))).energy;
    }
  }
  return sum;
}

double InPlanePotential::add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  static const PetscLogEvent event = log_event("InPlaneGradient");
  const LogScope scope(event, 400.0 * static_cast<double>(cells_.size()));
  const PetscInt owned = sheet_.particles.owned;
  double sum = 0;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const Cell& cell = cells_[c];
    if (area_of(cell) == 0) {
      continue;
    }
    const Arms arms = arms_of(cell.points, x.data());
    const State at = state(cell, squares_of(arms));
    sum += static_cast<PetscInt>(c) < sheet_.elements.owned ? at.energy : 0;
    const OfEdges slope = by_squares(cell, at.stress);
    for (std::size_t e = 0; e < edges; ++e) {
      const Eigen::Vector3d pull = 2 * slope[e] * arms.col(e);
      const PetscInt first = cell.points[ends[e][0]];
      const PetscInt last = cell.points[ends[e][1]];
      if (first < owned) {
        gradient.col(first) -= pull;
      }
      if (last < owned) {
        gradient.col(last) += pull;
      }
    }
  }
  return sum;
}

std::vector<VertexPair> InPlanePotential::pattern() const {
  std::vector<VertexPair> pairs;
  pairs.reserve(25 * cells_.size());
  for (const Cell& cell : cells_) {
    for (const PetscInt i : cell.points) {
      for (const PetscInt j : cell.points) {
        pairs.push_back({i, sheet_.particles.to_global(j)});
      }
    }
  }
  return pairs;
}

void InPlanePotential::update_hessian(const Field& x, double psd_blend) {
  static const PetscLogEvent event = log_event("InPlaneHessian");
  const LogScope scope(event, 400.0 * static_cast<double>(cells_.size()));
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const Cell& cell = cells_[c];
    CellTerms& terms = hessian_[c / lanes];
    const std::size_t lane = c % lanes;
    const Arms arms = arms_of(cell.points, x.data());
    OfEdges slope = OfEdges::Zero();
    if (area_of(cell) > 0) {
      const State at = state(cell, squares_of(arms));
      slope = by_squares(cell, at.stress);
      if (psd_blend > 0) {
        std::array<Mandel, 4> positive;
        std::transform(at.stress.begin(), at.stress.end(), positive.begin(), without_compression);
        slope += psd_blend * (by_squares(cell, positive) - slope);
      }
    }
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t i = 0; i < 3; ++i) {
        terms.arm[k][i][lane] = arms(i, 4 + k);
      }
    }
    for (std::size_t e = 0; e < edges; ++e) {
      terms.spread[e][lane] = 2 * slope[e];
    }
  }
}

void InPlanePotential::add_hessian(const HessianBlocks& blocks) const {
  static const PetscLogEvent event = log_event("InPlaneBlocks");
  const LogScope scope(event, 2000.0 * static_cast<double>(cells_.size()));
  const bool wants_all = blocks.wants_off_diagonal();
  CellBlocks own;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    set_blocks(own, hessian_[c / lanes], c % lanes, wants_all);
    for (std::size_t i = 0; i < CellTerms::points; ++i) {
      blocks.add(25 * c + 6 * i, own[i][i]);
      for (std::size_t j = i + 1; wants_all && j < CellTerms::points; ++j) {
        blocks.add(25 * c + 5 * i + j, own[i][j]);
        blocks.add(25 * c + 5 * j + i, own[i][j].transpose());
      }
    }
  }
}

}  // namespace pellicle::elastic
