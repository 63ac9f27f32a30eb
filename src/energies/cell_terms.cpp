#include "energies/cell_terms.h"

#include <cstring>

namespace pellicle::energies {

namespace {

constexpr std::size_t lanes = CellTerms::lanes;
constexpr std::size_t edges = CellTerms::edges;
constexpr std::size_t points = CellTerms::points;

/// The product; inlined into one function for each instruction set.
[[gnu::always_inline]] inline void multiply(const CellTerms* cells, std::size_t count, const double* w,
                                            double* result) {
  using Lanes = CellTerms::Lanes;
  for (std::size_t b = 0; b < count; ++b) {
    const CellTerms& batch = cells[b];
    Lanes own[points][3];
    Lanes sum[points][3] = {};
    alignas(64) double places[points][3][lanes];
    for (std::size_t k = 0; k < points; ++k) {
      for (std::size_t i = 0; i < lanes; ++i) {
        const double* const from = w + 4 * batch.vertex[k][i];
        places[k][0][i] = from[0];
        places[k][1][i] = from[1];
        places[k][2][i] = from[2];
      }
    }
    std::memcpy(own, places, sizeof own);
    Lanes edge[edges][3];
    for (std::size_t c = 0; c < 3; ++c) {
      const Lanes first = batch.arm[0][c];
      const Lanes second = batch.arm[1][c];
      const Lanes third = batch.arm[2][c];
      edge[0][c] = first;
      edge[1][c] = second - first;
      edge[2][c] = third - second;
      edge[3][c] = -third;
      edge[4][c] = second;
      edge[5][c] = third - first;
    }
    Lanes along[edges];
    for (std::size_t e = 0; e < edges; ++e) {
      const auto& from = own[CellTerms::ends[e][0]];
      const auto& to = own[CellTerms::ends[e][1]];
      along[e] = edge[e][0] * (to[0] - from[0]) + edge[e][1] * (to[1] - from[1]) + edge[e][2] * (to[2] - from[2]);
    }
    Lanes pull[edges] = {};
    const Lanes* coupling = batch.coupling;
    for (std::size_t e = 0; e < edges; ++e) {
      pull[e] += *coupling++ * along[e];
      for (std::size_t f = e + 1; f < edges; ++f, ++coupling) {
        pull[e] += *coupling * along[f];
        pull[f] += *coupling * along[e];
      }
    }
    for (std::size_t e = 0; e < edges; ++e) {
      const auto& [first, last] = CellTerms::ends[e];
      for (std::size_t c = 0; c < 3; ++c) {
        const Lanes force = pull[e] * edge[e][c] + batch.spread[e] * (own[last][c] - own[first][c]);
        sum[first][c] -= force;
        sum[last][c] += force;
      }
    }
    std::memcpy(places, sum, sizeof sum);
    for (std::size_t k = 0; k < points; ++k) {
      for (std::size_t i = 0; i < lanes; ++i) {
        double* const to = result + 4 * batch.vertex[k][i];
        to[0] += places[k][0][i];
        to[1] += places[k][1][i];
        to[2] += places[k][2][i];
      }
    }
  }
}

using Multiply = void (*)(const CellTerms*, std::size_t, const double*, double*);

void multiply_plain(const CellTerms* cells, std::size_t count, const double* w, double* result) {
  multiply(cells, count, w, result);
}

#if defined(__x86_64__)
[[gnu::target("avx2,fma")]] void multiply_avx2(const CellTerms* cells, std::size_t count, const double* w,
                                               double* result) {
  multiply(cells, count, w, result);
}

[[gnu::target("avx512f,avx512dq,avx512vl,avx2,fma")]] void multiply_avx512(const CellTerms* cells, std::size_t count,
                                                                           const double* w, double* result) {
  multiply(cells, count, w, result);
}
#endif

/// The fastest variant that this processor can run.
Multiply fastest_multiply() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
    return multiply_avx512;
  }
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    return multiply_avx2;
  }
#endif
  return multiply_plain;
}

}  // namespace

Eigen::Matrix<double, 3, edges> CellTerms::edges_of(std::size_t lane) const {
  Eigen::Matrix<double, 3, 4> place = Eigen::Matrix<double, 3, 4>::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    place.col(1 + k) << arm[k][0][lane], arm[k][1][lane], arm[k][2][lane];
  }
  Eigen::Matrix<double, 3, edges> result;
  for (std::size_t e = 0; e < edges; ++e) {
    result.col(e) = place.col(ends[e][1]) - place.col(ends[e][0]);
  }
  return result;
}

Eigen::Matrix<double, edges, edges> CellTerms::coupling_of(std::size_t lane) const {
  Eigen::Matrix<double, edges, edges> result;
  std::size_t k = 0;
  for (std::size_t e = 0; e < edges; ++e) {
    for (std::size_t f = e; f < edges; ++f) {
      result(e, f) = result(f, e) = coupling[k++][lane];
    }
  }
  return result;
}

Eigen::Matrix<double, points, points> CellTerms::across_of(std::size_t lane) const {
  Eigen::Matrix<double, points, points> result = Eigen::Matrix<double, points, points>::Zero();
  for (std::size_t e = 0; e < edges; ++e) {
    const auto& [first, last] = ends[e];
    result(first, first) += spread[e][lane];
    result(last, last) += spread[e][lane];
    result(first, last) -= spread[e][lane];
    result(last, first) -= spread[e][lane];
  }
  return result;
}

void set_blocks(CellBlocks& blocks, const CellTerms& cells, std::size_t lane, bool wants_off_diagonal) {
  const Eigen::Matrix<double, 3, edges> arms = cells.edges_of(lane);
  const Eigen::Matrix<double, edges, edges> coupling = cells.coupling_of(lane);
  const Eigen::Matrix<double, points, points> across = cells.across_of(lane);
  for (std::size_t j = 0; j < points; ++j) {
    for (std::size_t i = wants_off_diagonal ? 0 : j; i <= j; ++i) {
      blocks[i][j] = across(i, j) * Eigen::Matrix3d::Identity();
    }
    Eigen::Matrix<double, edges, 3> pull = Eigen::Matrix<double, edges, 3>::Zero();  // of the edges by a shift of j
    for (std::size_t f = 0; f < edges; ++f) {
      if (const auto& [first, last] = CellTerms::ends[f]; first == j || last == j) {
        pull += (last == j ? 1 : -1) * coupling.col(f) * arms.col(f).transpose();
      }
    }
    for (std::size_t e = 0; e < edges; ++e) {
      const Eigen::Matrix3d block = arms.col(e) * pull.row(e);
      const auto& [first, last] = CellTerms::ends[e];
      for (const std::size_t i : {first, last}) {
        if (i == j || (i < j && wants_off_diagonal)) {
          blocks[i][j] += (i == last ? 1 : -1) * block;
        }
      }
    }
  }
}

void multiply_cells(const CellTerms* cells, std::size_t count, const double* w, double* result) {
  static const Multiply multiply_fast = fastest_multiply();
  multiply_fast(cells, count, w, result);
}

}  // namespace pellicle::energies
