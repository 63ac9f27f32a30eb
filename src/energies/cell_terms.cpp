#include "energies/cell_terms.h"

#include <algorithm>
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
      for (std::size_t k = 0; k < 4; ++k) {
        edge[4 + k][c] = batch.arm[k][c];
        edge[k][c] = batch.arm[k][c] - batch.arm[(k + 1) % 4][c];
      }
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
  Eigen::Matrix<double, 3, edges> result;
  for (std::size_t k = 0; k < 4; ++k) {
    result.col(4 + k) << arm[k][0][lane], arm[k][1][lane], arm[k][2][lane];
  }
  for (std::size_t k = 0; k < 4; ++k) {
    result.col(k) = result.col(4 + k) - result.col(4 + (k + 1) % 4);
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

void set_blocks(CellBlocks& blocks, const CellTerms& cells, std::size_t lane, bool wants_off_diagonal) {
  /// Edges that begin (-) or end (+) at a point.
  struct Side {
    std::size_t edge;
    double sign;
  };
  static constexpr std::array<std::array<Side, 4>, points> at{{{{{0, -1}, {3, 1}, {4, -1}}},
                                                               {{{1, -1}, {0, 1}, {5, -1}}},
                                                               {{{2, -1}, {1, 1}, {6, -1}}},
                                                               {{{3, -1}, {2, 1}, {7, -1}}},
                                                               {{{4, 1}, {5, 1}, {6, 1}, {7, 1}}}}};
  const auto count = [](std::size_t point) -> std::size_t { return point < 4 ? 3 : 4; };
  const Eigen::Matrix<double, 3, edges> arms = cells.edges_of(lane);
  const Eigen::Matrix<double, edges, edges> coupling = cells.coupling_of(lane);
  for (std::size_t j = 0; j < points; ++j) {
    for (std::size_t i = wants_off_diagonal ? 0 : j; i <= j; ++i) {
      Eigen::Matrix3d& block = blocks[i][j];
      block.setZero();
      for (std::size_t e = 0; e < count(i); ++e) {
        const auto& [edge, sign] = at[i][e];
        Eigen::Vector3d pull = Eigen::Vector3d::Zero();  // of the edge by a shift of point j
        for (std::size_t f = 0; f < count(j); ++f) {
          pull += sign * at[j][f].sign * coupling(edge, at[j][f].edge) * arms.col(at[j][f].edge);
        }
        block += arms.col(edge) * pull.transpose();
      }
    }
  }
  for (std::size_t e = 0; e < edges; ++e) {
    const auto& [first, last] = CellTerms::ends[e];
    const double spread = cells.spread[e][lane];
    blocks[first][first].diagonal().array() += spread;
    blocks[last][last].diagonal().array() += spread;
    if (wants_off_diagonal) {
      blocks[std::min(first, last)][std::max(first, last)].diagonal().array() -= spread;
    }
  }
}

void multiply_cells(const CellTerms* cells, std::size_t count, const double* w, double* result) {
  static const Multiply multiply_fast = fastest_multiply();
  multiply_fast(cells, count, w, result);
}

}  // namespace pellicle::energies
