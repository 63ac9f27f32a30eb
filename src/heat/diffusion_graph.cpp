#include "heat/diffusion_graph.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "surface/drawn_surface.h"

namespace pellicle::heat {

namespace {

/// Distances and areas are not taken smaller than this fraction of the initial ones: a crumpled sheet must not make a
/// weight infinite.
constexpr double smallest_share = 1e-3;

double triangle_area(const std::array<Eigen::Vector3d, 3>& x) { return 0.5 * (x[1] - x[0]).cross(x[2] - x[0]).norm(); }

/// Pairs of an element: the sides of its triangle; of a quad its sides, then from its corners to its centre.
std::size_t pairs_of_element(const Surface& surface) { return surface.has_quads() ? 8 : 3; }

/// Numbers among an element's pairs of a surface triangle's points 0 and 1, 0 and 2, 1 and 2.
std::array<std::size_t, 3> sides_of(const Surface& surface, std::size_t triangle) {
  return surface.has_quads() ? std::array{triangle, 4 + triangle, 4 + (triangle + 1) % 4}
                             : std::array<std::size_t, 3>{0, 1, 2};
}

}  // namespace

void DiffusionGraph::add_up_inflow(const Field& values, Eigen::VectorXd& sum) const {
  const double* value = values.data();
  sum.setZero(values.values().cols());
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const auto [a, b] = pairs[p];
    const double flow = weights[p] * (value[b] - value[a]);
    sum[a] += flow;
    sum[b] -= flow;
  }
}

std::vector<std::array<PetscInt, 2>> umbrella_pairs(const Surface& surface) {
  std::vector<std::array<PetscInt, 2>> pairs;
  for (const SpringSet& set : surface.springs) {
    pairs.insert(pairs.end(), set.ends.begin(), set.ends.end());
  }
  return pairs;
}

void set_umbrella(DiffusionGraph& graph, const Surface& surface, const std::vector<double>& diffusivity,
                  const Field& positions, const ActiveSet& active) {
  graph.weights.assign(graph.pairs.size(), 0);
  const PetscInt owned = surface.particles.owned;
  graph.capacity.setZero(owned);
  std::size_t p = 0;
  for (std::size_t colour = 0; colour < surface.springs.size(); ++colour) {
    const SpringSet& set = surface.springs[colour];
    for (std::size_t s = 0; s < set.ends.size(); ++s, ++p) {
      if (!active.springs[colour][s]) {
        continue;
      }
      const auto [a, b] = set.ends[s];
      const double distance =
          std::max((positions.vector(a) - positions.vector(b)).norm(), smallest_share * set.initial_length[s]);
      const double alpha = 0.5 * (diffusivity[a] + diffusivity[b]);
      graph.weights[p] = alpha / distance;
      for (const PetscInt end : set.ends[s]) {
        if (end < owned) {
          graph.capacity[end] += 0.5 * distance;
        }
      }
    }
  }
}

std::vector<std::array<PetscInt, 2>> cotangent_pairs(const Surface& surface) {
  const std::size_t per_element = surface.triangles_per_element;
  const std::size_t pairs_each = pairs_of_element(surface);
  std::vector<std::array<PetscInt, 2>> pairs(pairs_each * surface.triangles.size() / per_element);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    const std::array<std::size_t, 3> side = sides_of(surface, t % per_element);
    const std::size_t first = t / per_element * pairs_each;
    pairs[first + side[2]] = {b, c};
    pairs[first + side[1]] = {a, c};
    pairs[first + side[0]] = {a, b};
  }
  return pairs;
}

void set_cotangent(DiffusionGraph& graph, const Surface& surface, const std::vector<double>& diffusivity,
                   const Field& positions, const Field& mass, const ActiveSet& active) {
  graph.weights.assign(graph.pairs.size(), 0);
  const auto mass_ratio = [&](PetscInt i) { return mass.data()[i] / surface.initial_mass[i]; };
  const std::array<double, 3> fraction = surface.point_shares();
  const std::size_t per_element = surface.triangles_per_element;
  const std::size_t pairs_each = pairs_of_element(surface);

  for (std::size_t element = 0; element < surface.element_mass.size(); ++element) {
    const DrawnPlaces present(surface, positions.data(), element);
    const DrawnPlaces rest(surface, surface.rest.data(), element);
    std::array<double, 4> area{};
    double element_area = 0;
    double element_ratio = 0;
    for (std::size_t k = 0; k < per_element; ++k) {
      const std::array<PetscInt, 3>& triangle = surface.triangles[per_element * element + k];
      area[k] = std::max(triangle_area(present(triangle)), smallest_share * triangle_area(rest(triangle)));
      element_area += area[k];
      for (std::size_t i = 0; i < 3; ++i) {
        element_ratio += fraction[i] * mass_ratio(triangle[i]);
      }
    }
    element_ratio /= static_cast<double>(per_element);
    const double density = surface.element_mass[element] * element_ratio / element_area;

    // K_ab = e_a . e_b / (4 A) with e_a the edge opposite to a, whose negative is the weight of the pair.
    double* weight = &graph.weights[pairs_each * element];
    for (std::size_t k = 0; k < per_element; ++k) {
      if (!active.triangles[per_element * element + k]) {
        continue;
      }
      const std::array<PetscInt, 3>& triangle = surface.triangles[per_element * element + k];
      const auto [xa, xb, xc] = present(triangle);
      const auto [a, b, c] = triangle;
      const std::array<std::size_t, 3> side = sides_of(surface, k);
      const double factor = density * (diffusivity[a] + diffusivity[b] + diffusivity[c]) / 3 / (4 * area[k]);
      weight[side[0]] -= factor * (xc - xb).dot(xa - xc);
      weight[side[1]] -= factor * (xc - xb).dot(xb - xa);
      weight[side[2]] -= factor * (xa - xc).dot(xb - xa);
    }
  }
  graph.capacity = mass.values().row(0).head(surface.particles.owned);
}

}  // namespace pellicle::heat
