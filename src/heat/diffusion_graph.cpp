#include "heat/diffusion_graph.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace pellicle {

namespace {

/// No distance is taken shorter, and no area smaller, than this share of the initial one: a crumpled sheet must not
/// make a weight infinite.
constexpr double smallest_share = 1e-3;

double triangle_area(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return 0.5 * (b - a).cross(c - a).norm();
}

Eigen::Vector3d corner_mean(const Eigen::Map<const Eigen::Matrix3Xd>& x, const std::array<PetscInt, 4>& cell) {
  return 0.25 * (x.col(cell[0]) + x.col(cell[1]) + x.col(cell[2]) + x.col(cell[3]));
}

Eigen::Map<const Eigen::Matrix3Xd> columns(const double* values, const Sheet& sheet) {
  return {values, 3, sheet.particles.local()};
}

}  // namespace

Eigen::VectorXd DiffusionGraph::inflow(const Field& values) const {
  const double* value = values.data();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(values.values().cols());
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const auto [a, b] = pairs[p];
    const double flow = weights[p] * (value[b] - value[a]);
    sum[a] += flow;
    sum[b] -= flow;
  }
  return sum.head(capacity.size());
}

std::vector<std::array<PetscInt, 2>> umbrella_pairs(const Sheet& sheet) {
  std::vector<std::array<PetscInt, 2>> pairs;
  for (const SpringSet& set : sheet.springs) {
    pairs.insert(pairs.end(), set.ends.begin(), set.ends.end());
  }
  return pairs;
}

void set_umbrella(DiffusionGraph& graph, const Sheet& sheet, const std::vector<double>& diffusivity,
                  const Field& positions, const Living& living) {
  graph.weights.assign(graph.pairs.size(), 0);
  Eigen::VectorXd capacity = Eigen::VectorXd::Zero(sheet.particles.local());
  std::size_t p = 0;
  for (std::size_t colour = 0; colour < sheet.springs.size(); ++colour) {
    const SpringSet& set = sheet.springs[colour];
    for (std::size_t s = 0; s < set.ends.size(); ++s, ++p) {
      if (!living.springs[colour][s]) {
        continue;
      }
      const auto [a, b] = set.ends[s];
      const double distance =
          std::max((positions.vector(a) - positions.vector(b)).norm(), smallest_share * set.initial_length[s]);
      const double alpha = 0.5 * (diffusivity[static_cast<std::size_t>(a)] + diffusivity[static_cast<std::size_t>(b)]);
      graph.weights[p] = alpha / distance;
      capacity[a] += 0.5 * distance;
      capacity[b] += 0.5 * distance;
    }
  }
  graph.capacity = capacity.head(sheet.particles.owned);
}

std::vector<std::array<PetscInt, 2>> cotangent_pairs(const Sheet& sheet) {
  std::vector<std::array<PetscInt, 2>> pairs;
  pairs.reserve(8 * sheet.cells.size());
  for (std::size_t c = 0; c < sheet.cells.size(); ++c) {
    const std::array<PetscInt, 4>& cell = sheet.cells[c];
    for (std::size_t k = 0; k < 4; ++k) {
      pairs.push_back({cell[k], cell[(k + 1) % 4]});
    }
    for (std::size_t k = 0; k < 4; ++k) {
      pairs.push_back({cell[k], sheet.lattice[c]});
    }
  }
  return pairs;
}

void set_cotangent(DiffusionGraph& graph, const Sheet& sheet, const std::vector<double>& diffusivity,
                   const Field& positions, const Field& mass, const Living& living) {
  graph.weights.assign(graph.pairs.size(), 0);
  const auto x = columns(positions.data(), sheet);
  const auto rest = columns(sheet.rest.data(), sheet);
  const auto mass_ratio = [&](PetscInt i) { return mass.data()[i] / sheet.initial_mass[static_cast<std::size_t>(i)]; };
  const auto alpha = [&](PetscInt i) { return diffusivity[static_cast<std::size_t>(i)]; };

  for (std::size_t c = 0; c < sheet.cells.size(); ++c) {
    const std::array<PetscInt, 4>& cell = sheet.cells[c];
    const PetscInt lattice = sheet.lattice[c];
    const Eigen::Vector3d centre = corner_mean(x, cell);
    const Eigen::Vector3d rest_centre = corner_mean(rest, cell);

    std::array<double, 4> area{};
    double cell_area = 0;
    double corner_ratio = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const PetscInt a = cell[k];
      const PetscInt b = cell[(k + 1) % 4];
      area[k] = std::max(triangle_area(x.col(a), x.col(b), centre),
                         smallest_share * triangle_area(rest.col(a), rest.col(b), rest_centre));
      cell_area += area[k];
      corner_ratio += 0.25 * mass_ratio(a);
    }
    // The lattice particle has half of the cell's initial mass, the corners' shares of this cell are the other half.
    const double cell_mass =
        sheet.initial_mass[static_cast<std::size_t>(lattice)] * (mass_ratio(lattice) + corner_ratio);
    const double density = cell_mass / cell_area;

    // K_ab = e_a . e_b / (4 A) with e_a the edge opposite to a, whose negative is the weight of the pair.
    double* edge_weight = &graph.weights[8 * c];
    double* spoke_weight = edge_weight + 4;
    for (std::size_t k = 0; k < 4; ++k) {
      if (!living.triangles[4 * c + k]) {
        continue;
      }
      const std::size_t next = (k + 1) % 4;
      const PetscInt a = cell[k];
      const PetscInt b = cell[next];
      const Eigen::Vector3d opposite_a = centre - x.col(b);
      const Eigen::Vector3d opposite_b = x.col(a) - centre;
      const Eigen::Vector3d opposite_centre = x.col(b) - x.col(a);
      const double factor = density * (alpha(a) + alpha(b) + alpha(lattice)) / 3 / (4 * area[k]);
      edge_weight[k] -= factor * opposite_a.dot(opposite_b);
      spoke_weight[k] -= factor * opposite_a.dot(opposite_centre);
      spoke_weight[next] -= factor * opposite_b.dot(opposite_centre);
    }
  }
  graph.capacity = mass.values().row(0).head(sheet.particles.owned);
}

}  // namespace pellicle
