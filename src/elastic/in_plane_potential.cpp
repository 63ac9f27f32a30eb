#include "elastic/in_plane_potential.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/log_event.h"
#include "elastic/sheet_geometry.h"
#include "geometry/pressure_load.h"
#include "surface/drawn_surface.h"

namespace pellicle::elastic {

namespace {

constexpr double share_of_triangles = 1.0 / 3;  // c over the least eigenvalue of C

constexpr std::size_t lanes = CellTerms::lanes;
constexpr std::size_t edges = CellTerms::edges;
constexpr auto ends = CellTerms::ends;

using OfEdges = Eigen::Matrix<double, edges, 1>;
using Edges = Eigen::Matrix<double, 3, edges>;

Eigen::Map<const Eigen::Vector3d> place(const double* x, PetscInt i) {
  return Eigen::Map<const Eigen::Vector3d>(x + 3 * i);
}

Edges cell_edges(const std::array<PetscInt, 4>& corners, const double* x) {
  Edges result;
  for (std::size_t e = 0; e < edges; ++e) {
    result.col(e) = place(x, corners[ends[e][1]]) - place(x, corners[ends[e][0]]);
  }
  return result;
}

OfEdges squares_of(const Edges& edges) { return edges.colwise().squaredNorm(); }

/// The derivative of the squared distance of corner k from the mean of all four by the squared lengths of the edges.
Eigen::Matrix<double, 1, edges> square_to_mean(std::size_t k) {
  Eigen::Matrix<double, 1, edges> result;
  for (std::size_t e = 0; e < edges; ++e) {
    result[e] = (ends[e][0] == k || ends[e][1] == k ? 0.25 : 0) - 0.0625;
  }
  return result;
}

/// The derivative of Green's strain (E11, E22, sqrt(2) E12), by axes along warp and weft, by the squared lengths of
/// its side and of the edges from the side's first and second corner to the third. @param side, arm undeformed: the
/// side, and from its first corner to the third
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
    const auto at = [&](std::size_t k) { return place(sheet.rest.data(), sheet.cells[c][k % 4]); };
    const Eigen::Vector3d middle = (at(0) + at(1) + at(2) + at(3)) / 4;
    cell.rest = squares_of(cell_edges(sheet.cells[c], sheet.rest.data()));
    for (std::size_t t = 0; t < 4; ++t) {
      const Eigen::Vector3d side = at(t + 1) - at(t);
      const Eigen::Vector3d arm = middle - at(t);
      const Eigen::Matrix3d strain = strain_by_squares(side, arm, warps.col(sheet.lattice[c]));
      cell.by_squares[t] = strain.col(1) * square_to_mean(t) + strain.col(2) * square_to_mean((t + 1) % 4);
      cell.by_squares[t].col(static_cast<Eigen::Index>(t)) += strain.col(0);
      cell.undeformed_area[t] = side.cross(arm).norm() / 2;
    }
    // The lines between the middles of opposite sides, and the difference of both, which is a diagonal.
    const Eigen::Vector3d along = (at(1) + at(2) - at(0) - at(3)) / 2;
    const Eigen::Vector3d across = (at(2) + at(3) - at(0) - at(1)) / 2;
    const Eigen::Matrix3d strain = strain_by_squares(along, across, warps.col(sheet.lattice[c]));
    using Row = Eigen::Matrix<double, 1, edges>;
    cell.by_squares[4] = strain.col(0) * 0.25 * Row(1, -1, 1, -1, 1, 1) +
                         strain.col(1) * 0.25 * Row(-1, 1, -1, 1, 1, 1) + strain.col(2) * Row(0, 0, 0, 0, 0, 1);
    cell.stiffness = plane_stiffness(stiffness, mean(c, factors.tensile), mean(c, factors.shear));
    cell.least = share_of_triangles *
                 std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(cell.stiffness).eigenvalues().minCoeff());
    for (std::size_t k = 0; k < CellTerms::points; ++k) {
      hessian_[c / lanes].vertex[k][c % lanes] = sheet.cells[c][k];
    }
  }
}

/// Mean over a cell of values of the particles, half of it of the lattice point; 1 if there are none.
double InPlanePotential::mean(std::size_t cell, const std::vector<double>& values) const {
  const auto& [a, b, c, d] = sheet_.cells[cell];
  return values.empty() ? 1 : (values[a] + values[b] + values[c] + values[d]) / 8 + values[sheet_.lattice[cell]] / 2;
}

void InPlanePotential::begin_step(const ActiveSet& active, const Field& start, const Input& input) {
  const bool has_other_viscosity = viscosity_ != input.damping_over_step;
  viscosity_ = input.damping_over_step;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    Cell& cell = cells_[c];
    const double factor = mean(c, input.factor);
    bool is_other = has_other_viscosity || factor != cell.factor;
    cell.factor = factor;
    for (std::size_t t = 0; t < 4; ++t) {
      const auto& [first, second, lattice] = sheet_.triangles[4 * c + t];
      const double scale = (input.shrinkage[first] + input.shrinkage[second]) / 4 + input.shrinkage[lattice] / 2;
      const double area = active.triangles[4 * c + t] ? cell.undeformed_area[t] * scale * scale : 0;
      is_other = is_other || area != cell.area[t] || scale * scale != cell.squared_scale[t];
      cell.area[t] = area;
      cell.squared_scale[t] = scale * scale;
    }
    if (is_other) {
      cell.area[4] = cell.area[0] + cell.area[1] + cell.area[2] + cell.area[3];
      cell.squared_scale[4] = 0;
      for (std::size_t t = 0; t < 4 && cell.area[4] > 0; ++t) {
        cell.squared_scale[4] += cell.area[t] / cell.area[4] * cell.squared_scale[t];
      }
      set_coupling(c);
    }
    if (viscosity_ > 0) {
      cell.start = squares_of(cell_edges(sheet_.cells[c], start.data()));
    }
  }
}

/// Sets the coupling of a cell's edges: four times the second derivative of the energy by their squared lengths.
void InPlanePotential::set_coupling(std::size_t number) {
  const Cell& cell = cells_[number];
  CellTerms& terms = hessian_[number / lanes];
  const std::size_t lane = number % lanes;
  Eigen::Matrix<double, edges, edges> second = Eigen::Matrix<double, edges, edges>::Zero();
  if (cell.area[4] > 0) {
    const StrainBySquares mean = cell.by_squares[4] / cell.squared_scale[4];
    second = cell.area[4] * mean.transpose() * cell.stiffness * mean;
    for (std::size_t t = 0; t < 4; ++t) {
      const StrainBySquares other = cell.by_squares[t] / cell.squared_scale[t] - mean;
      second += cell.area[t] * cell.least * other.transpose() * other;
    }
    second *= 4 * cell.factor * (1 + viscosity_);
  }
  std::size_t k = 0;
  for (std::size_t e = 0; e < edges; ++e) {
    for (std::size_t f = e; f < edges; ++f) {
      terms.coupling[k++][lane] = second(e, f);
    }
  }
}

/// @param strain_of gives the strain of a triangle, or the mean
template <class StrainOf>
InPlanePotential::State InPlanePotential::state_of(const Cell& cell, const StrainOf& strain_of) {
  const Mandel mean = strain_of(4);
  const Mandel stress = cell.factor * cell.stiffness * mean;
  State state;
  state.energy = cell.area[4] * stress.dot(mean) / 2;
  state.stress[4] = stress;
  for (std::size_t t = 0; t < 4; ++t) {
    const Mandel other = strain_of(t) - mean;
    state.stress[t] = cell.factor * cell.least * other;
    state.stress[4] -= cell.area[t] / cell.area[4] * state.stress[t];
    state.energy += cell.area[t] * state.stress[t].dot(other) / 2;
  }
  return state;
}

InPlanePotential::State InPlanePotential::elastic_state(const Cell& cell, const OfEdges& squares) const {
  return state_of(cell, [&](std::size_t t) -> Mandel {
    return cell.by_squares[t] * (squares / cell.squared_scale[t] - cell.rest);
  });
}

InPlanePotential::State InPlanePotential::state(const Cell& cell, const OfEdges& squares) const {
  State state = elastic_state(cell, squares);
  if (viscosity_ > 0) {
    const OfEdges change = squares - cell.start;
    const State viscous =
        state_of(cell, [&](std::size_t t) -> Mandel { return cell.by_squares[t] * change / cell.squared_scale[t]; });
    for (std::size_t t = 0; t < state.stress.size(); ++t) {
      state.stress[t] += viscosity_ * viscous.stress[t];
    }
    state.energy += viscosity_ * viscous.energy;
  }
  return state;
}

/// The derivative of the energy by the squared lengths of the edges [N/m].
InPlanePotential::OfEdges InPlanePotential::by_squares(const Cell& cell, const std::array<Mandel, 5>& stress) {
  OfEdges result = OfEdges::Zero();
  for (std::size_t t = 0; t < stress.size(); ++t) {
    result += cell.area[t] / cell.squared_scale[t] * (cell.by_squares[t].transpose() * stress[t]);
  }
  return result;
}

double InPlanePotential::elastic_energy(const Field& x) const {
  double sum = 0;
  for (PetscInt c = 0; c < sheet_.elements.owned; ++c) {
    if (const Cell& cell = cells_[c]; cell.area[4] > 0) {
      sum += elastic_state(cell, squares_of(cell_edges(sheet_.cells[c], x.data()))).energy;
    }
  }
  return sum;
}

std::vector<Eigen::Matrix3d> InPlanePotential::stress(const Field& x) const {
  std::vector<Eigen::Matrix3d> result;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const Cell& cell = cells_[c];
    Eigen::Matrix3d& sum = result.emplace_back(Eigen::Matrix3d::Zero());
    double area = 0;
    for (std::size_t t = 4 * c; t < 4 * c + 4; ++t) {
      const auto [first, second, middle] = places_of_triangle(sheet_, x.data(), t);
      area += cell.area[t % 4] > 0 ? area_vector(first, second, middle).norm() : 0;
    }
    if (area > 0) {  // A small strain d changes the square of an edge by 2 edge.d edge, and U by area stress:d.
      const Edges edges = cell_edges(sheet_.cells[c], x.data());
      sum = 2 / area * edges * by_squares(cell, state(cell, squares_of(edges)).stress).asDiagonal() * edges.transpose();
    }
  }
  return result;
}

double InPlanePotential::value(const Field& x) const {
  static const PetscLogEvent event = log_event("InPlaneEnergy");
  const LogScope scope(event, 250.0 * static_cast<double>(sheet_.elements.owned));
  double sum = 0;
  for (PetscInt c = 0; c < sheet_.elements.owned; ++c) {
    if (const Cell& cell = cells_[c]; cell.area[4] > 0) {
      sum += state(cell, squares_of(cell_edges(sheet_.cells[c], x.data()))).energy;
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
    if (cell.area[4] == 0) {
      continue;
    }
    const Edges edge = cell_edges(sheet_.cells[c], x.data());
    const State at = state(cell, squares_of(edge));
    sum += static_cast<PetscInt>(c) < sheet_.elements.owned ? at.energy : 0;
    const OfEdges slope = by_squares(cell, at.stress);
    for (std::size_t e = 0; e < edges; ++e) {
      const Eigen::Vector3d pull = 2 * slope[e] * edge.col(e);
      const PetscInt first = sheet_.cells[c][ends[e][0]];
      const PetscInt last = sheet_.cells[c][ends[e][1]];
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
  pairs.reserve(16 * cells_.size());
  for (const auto& corners : sheet_.cells) {
    for (const PetscInt i : corners) {
      for (const PetscInt j : corners) {
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
    OfEdges slope = OfEdges::Zero();
    if (cell.area[4] > 0) {
      const State at = state(cell, squares_of(cell_edges(sheet_.cells[c], x.data())));
      slope = by_squares(cell, at.stress);
      if (psd_blend > 0) {
        std::array<Mandel, 5> positive;
        std::transform(at.stress.begin(), at.stress.end(), positive.begin(), without_compression);
        slope += psd_blend * (by_squares(cell, positive) - slope);
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d arm = place(x.data(), sheet_.cells[c][k + 1]) - place(x.data(), sheet_.cells[c][0]);
      for (std::size_t i = 0; i < 3; ++i) {
        terms.arm[k][i][lane] = arm[static_cast<Eigen::Index>(i)];
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
      blocks.add(16 * c + 5 * i, own[i][i]);
      for (std::size_t j = i + 1; wants_all && j < CellTerms::points; ++j) {
        blocks.add(16 * c + 4 * i + j, own[i][j]);
        blocks.add(16 * c + 4 * j + i, own[i][j].transpose());
      }
    }
  }
}

}  // namespace pellicle::elastic
