#include "ablation/stress_average.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "geometry/pressure_load.h"
#include "parallel/collective.h"
#include "surface/drawn_surface.h"

namespace pellicle::ablation {

namespace {

constexpr double time_step = 1;  // [s]

/// lambda over l: then a clamped strip with a long slit tears at the stress intensity s_average sqrt(pi l), within 5 %
/// for l of 1.3 to 5 cells and up to a tenth of the strip's width.
constexpr double conduction_length = 1.4;
/// Elements, with the transfer of their values to particles and back, average by themselves like a length l of so many
/// element sizes, as the loads show at which notched sheets of quads and of triangles crack.
constexpr double own_sizes = 0.85;

/// The length l over which the elements round each local particle average by themselves [m]. Collective.
Field own_lengths(const Surface& surface) {
  const std::size_t per_element = surface.triangles_per_element;
  const double elements_per_vertex = surface.has_quads() ? 1 : 2;
  Field sums(surface.particles, 2);  // over the surface triangles round a particle: of sizes, and their number
  for (std::size_t e = 0; e < surface.element_mass.size(); ++e) {
    const DrawnPlaces places(surface, surface.rest.data(), e);
    double area = 0;
    for (std::size_t t = per_element * e; t < per_element * (e + 1); ++t) {
      const auto [a, b, c] = places(surface.triangles[t]);
      area += area_vector(a, b, c).norm();
    }
    const double size = std::sqrt(elements_per_vertex * area);
    for (std::size_t t = per_element * e; t < per_element * (e + 1); ++t) {
      for (const PetscInt particle : surface.triangles[t]) {
        sums.values().col(particle) += Eigen::Vector2d(size, 1);
      }
    }
  }
  Field lengths(surface.particles, 1);
  lengths.values() = own_sizes * sums.values().row(0).cwiseQuotient(sums.values().row(1).cwiseMax(1));
  lengths.update_ghosts();
  return lengths;
}

/// Options of the conduction whose step averages over the remainder of l.
HeatOptions conducting(double length, const std::string& solver_prefix) {
  HeatOptions options;
  options.solver_prefix = solver_prefix;
  options.ksp_rtol = 1e-10;  // of the largest tension squared, which may be many times the strength
  options.diffusivity = std::pow(conduction_length * length, 2) / time_step;
  return options;
}

/// Factors on the diffusivity of the local particles.
std::vector<double> factors(const Field& own_length, double length) {
  std::vector<double> result;
  for (const double own : own_length.values().row(0)) {
    const double rest = std::max(1 - own / length, 0.0);
    result.push_back(rest * rest);
  }
  return result;
}

}  // namespace

StressAverage::StressAverage(const Surface& surface, double length, const std::string& solver_prefix)
    : surface_(surface),
      own_length_(own_lengths(surface)),
      least_length_(max_over_ranks(surface.comm(),
                                   own_length_.values().leftCols(surface.particles.owned).lpNorm<Eigen::Infinity>())),
      conduction_(surface, conducting(length, solver_prefix), factors(own_length_, length)),
      rest_(surface.particles, 3),
      mass_(surface.particles, 1),
      tension_(surface.particles, 1),
      square_(surface.particles, 1),
      weight_(surface.initial_mass.size()) {
  rest_.values() = surface.rest;
  std::copy(surface.initial_mass.begin(), surface.initial_mass.end(), mass_.data());
}

std::vector<double> StressAverage::of(const std::vector<double>& tension, const ActiveSet& active) {
  const std::size_t per_element = surface_.triangles_per_element;
  const std::array<double, 3> fraction = surface_.point_shares();
  tension_.values().setZero();
  square_.values().setZero();
  std::fill(weight_.begin(), weight_.end(), 0);
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    if (active.triangles[t]) {
      const double s = tension[t / per_element];
      const double mass = surface_.element_mass[t / per_element];
      for (std::size_t k = 0; k < 3; ++k) {
        const PetscInt particle = surface_.triangles[t][k];
        const double weight = fraction[k] * mass;
        tension_.data()[particle] += weight * s;
        square_.data()[particle] += weight * s * s;
        weight_[particle] += weight;
      }
    }
  }
  for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
    const double weight = weight_[i];
    if (weight > 0) {
      tension_.data()[i] /= weight;
      square_.data()[i] /= weight;
    }
  }
  for (Field* values : {&tension_, &square_}) {  // right at the owned particles, all of whose elements are local
    values->update_ghosts();
    const StageResult averaged = conduction_.advance(*values, {rest_, mass_, active, time_step});
    if (!averaged.converged) {
      throw Error("ablation.strength_length: stress cannot be averaged: " + averaged.reason);
    }
  }

  std::vector<double> result(tension.size(), 0);
  for (std::size_t e = 0; e < result.size(); ++e) {
    double s = 0;
    double square = 0;
    for (std::size_t t = per_element * e; t < per_element * (e + 1); ++t) {
      for (std::size_t k = 0; k < 3 && active.triangles[t]; ++k) {
        s += fraction[k] * tension_.data()[surface_.triangles[t][k]];
        square += fraction[k] * square_.data()[surface_.triangles[t][k]];
      }
    }
    result[e] = s > 0 ? square / s : 0;
  }
  return result;
}

}  // namespace pellicle::ablation
