#include "prism/metric_stiffness.h"

#include "base/log_event.h"
#include "geometry/cross_matrix.h"
#include "surface/membrane.h"

namespace pellicle::prism {

namespace {

constexpr std::size_t lanes = StiffnessBatch::lanes;

/// The product of some batches; inlined into one function for each instruction set.
[[gnu::always_inline]] inline void multiply(const StiffnessBatch* batches, std::size_t count, double factor,
                                            const double* w, double* result) {
  for (std::size_t b = 0; b < count; ++b) {
    const StiffnessBatch& batch = batches[b];
    alignas(64) double w12[3][lanes];
    alignas(64) double w13[3][lanes];
    alignas(64) double y1[3][lanes];
    alignas(64) double y2[3][lanes];
    alignas(64) double y3[3][lanes];
    for (std::size_t i = 0; i < lanes; ++i) {
      const double* w1 = w + batch.corner[0][i];
      const double* w2 = w + batch.corner[1][i];
      const double* w3 = w + batch.corner[2][i];
      for (std::size_t c = 0; c < 3; ++c) {
        w12[c][i] = w2[c] - w1[c];
        w13[c][i] = w3[c] - w1[c];
      }
    }
    for (std::size_t i = 0; i < lanes; ++i) {
      const double ex = batch.e12[0][i], ey = batch.e12[1][i], ez = batch.e12[2][i];
      const double gx = batch.e13[0][i], gy = batch.e13[1][i], gz = batch.e13[2][i];
      const double ux = w12[0][i], uy = w12[1][i], uz = w12[2][i];
      const double vx = w13[0][i], vy = w13[1][i], vz = w13[2][i];
      const double s1 = ex * ux + ey * uy + ez * uz;
      const double s2 = ex * vx + ey * vy + ez * vz + gx * ux + gy * uy + gz * uz;
      const double s3 = gx * vx + gy * vy + gz * vz;
      const double q1 = batch.coupling[0][i] * s1 + batch.coupling[1][i] * s2 + batch.coupling[2][i] * s3;
      const double q2 = batch.coupling[1][i] * s1 + batch.coupling[3][i] * s2 + batch.coupling[4][i] * s3;
      const double q3 = batch.coupling[2][i] * s1 + batch.coupling[4][i] * s2 + batch.coupling[5][i] * s3;
      const double g11 = batch.spread[0][i], g12 = batch.spread[1][i], g22 = batch.spread[2][i];
      const double p = -factor * batch.load[i];
      const double lx = p * (uy * gz - uz * gy + ey * vz - ez * vy);
      const double ly = p * (uz * gx - ux * gz + ez * vx - ex * vz);
      const double lz = p * (ux * gy - uy * gx + ex * vy - ey * vx);
      const double fx = factor * (g11 * ux + g12 * vx + q1 * ex + q2 * gx);
      const double fy = factor * (g11 * uy + g12 * vy + q1 * ey + q2 * gy);
      const double fz = factor * (g11 * uz + g12 * vz + q1 * ez + q2 * gz);
      const double hx = factor * (g12 * ux + g22 * vx + q2 * ex + q3 * gx);
      const double hy = factor * (g12 * uy + g22 * vy + q2 * ey + q3 * gy);
      const double hz = factor * (g12 * uz + g22 * vz + q2 * ez + q3 * gz);
      y1[0][i] = lx - fx - hx;
      y1[1][i] = ly - fy - hy;
      y1[2][i] = lz - fz - hz;
      y2[0][i] = lx + fx;
      y2[1][i] = ly + fy;
      y2[2][i] = lz + fz;
      y3[0][i] = lx + hx;
      y3[1][i] = ly + hy;
      y3[2][i] = lz + hz;
    }
    for (std::size_t i = 0; i < lanes; ++i) {
      double* r1 = result + batch.corner[0][i];
      double* r2 = result + batch.corner[1][i];
      double* r3 = result + batch.corner[2][i];
      for (std::size_t c = 0; c < 3; ++c) {
        r1[c] += y1[c][i];
        r2[c] += y2[c][i];
        r3[c] += y3[c][i];
      }
    }
  }
}

using Multiply = void (*)(const StiffnessBatch*, std::size_t, double, const double*, double*);

void multiply_plain(const StiffnessBatch* batches, std::size_t count, double factor, const double* w, double* result) {
  multiply(batches, count, factor, w, result);
}

#if defined(__x86_64__)
[[gnu::target("avx2,fma")]] void multiply_avx2(const StiffnessBatch* batches, std::size_t count, double factor,
                                               const double* w, double* result) {
  multiply(batches, count, factor, w, result);
}

[[gnu::target("avx512f,avx512dq,avx512vl,avx2,fma")]] void multiply_avx512(const StiffnessBatch* batches,
                                                                           std::size_t count, double factor,
                                                                           const double* w, double* result) {
  multiply(batches, count, factor, w, result);
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

/// Adds the blocks of lane i of a batch. @param first number of the first of its nine
/// @param whole whether all nine are added; otherwise only the three of a corner with itself
void add_element(const StiffnessBatch& batch, std::size_t i, double factor, std::size_t first, bool whole,
                 const HessianBlocks& blocks) {
  const Eigen::Vector3d e12(batch.e12[0][i], batch.e12[1][i], batch.e12[2][i]);
  const Eigen::Vector3d e13(batch.e13[0][i], batch.e13[1][i], batch.e13[2][i]);
  const auto coupling = [&](int k) { return batch.coupling[k][i]; };
  const Eigen::Matrix3d load_2 = batch.load[i] * cross_matrix(e13);
  const Eigen::Matrix3d load_3 = -batch.load[i] * cross_matrix(e12);
  Eigen::Matrix3d b22 = e12 * (coupling(0) * e12 + coupling(1) * e13).transpose() +
                        e13 * (coupling(1) * e12 + coupling(3) * e13).transpose();
  Eigen::Matrix3d b23 = e12 * (coupling(1) * e12 + coupling(2) * e13).transpose() +
                        e13 * (coupling(3) * e12 + coupling(4) * e13).transpose();
  Eigen::Matrix3d b33 = e12 * (coupling(3) * e12 + coupling(4) * e13).transpose() +
                        e13 * (coupling(4) * e12 + coupling(5) * e13).transpose();
  b22.diagonal().array() += batch.spread[0][i];
  b23.diagonal().array() += batch.spread[1][i];
  b33.diagonal().array() += batch.spread[2][i];
  const Eigen::Matrix3d b32 = b23.transpose();
  const Eigen::Matrix3d block[3][2] = {{load_2 - b22 - b32, load_3 - b23 - b33},  // of the corners (a, 1) and (a, 2)
                                       {b22 + load_2, b23 + load_3},
                                       {b32 + load_2, b33 + load_3}};
  if (!whole) {
    blocks.add(first, -factor * (block[0][0] + block[0][1]));
    blocks.add(first + 4, factor * block[1][0]);
    blocks.add(first + 8, factor * block[2][1]);
    return;
  }
  for (std::size_t a = 0; a < 3; ++a) {
    blocks.add(first + 3 * a, -factor * (block[a][0] + block[a][1]));
    blocks.add(first + 3 * a + 1, factor * block[a][0]);
    blocks.add(first + 3 * a + 2, factor * block[a][1]);
  }
}

}  // namespace

MetricStiffness::MetricStiffness(const PrismElements& elements) : elements_(&elements) {
  const auto& triangles = elements.membrane().triangles;
  batches_.resize((triangles.size() + lanes - 1) / lanes);  // Unused lanes stay zero: nothing, on vertex 0.
  for (std::size_t e = 0; e < triangles.size(); ++e) {
    for (std::size_t a = 0; a < 3; ++a) {
      batches_[e / lanes].corner[a][e % lanes] = 3 * triangles[e][a];
    }
  }
}

void MetricStiffness::update(const Field& positions, const std::vector<double>& thickness_ratio,
                             const std::vector<double>& pressure, double left_out) {
  const auto& triangles = elements_->membrane().triangles;
  static const PetscLogEvent event = log_event("PrismStiffness");
  // Scaled entries, and the tests of positive_part; the work that it does where there is something to leave out is not
  // counted.
  const double by_element = 3 + 2 * 6 + 1 + (left_out > 0 ? 7 + 17 : 0);
  const LogScope scope(event, elements_->tangent_flops() + by_element * static_cast<double>(triangles.size()));
  for (std::size_t e = 0; e < triangles.size(); ++e) {
    StiffnessBatch& batch = batches_[e / lanes];
    const std::size_t lane = e % lanes;
    const auto [e12, e13] = edges_of(positions.data(), triangles[e]);
    for (int c = 0; c < 3; ++c) {
      batch.e12[c][lane] = e12[c];
      batch.e13[c][lane] = e13[c];
    }
    MetricEnergy tangent = elements_->element_energy(e, positions, thickness_ratio[e], Derivatives::second);
    if (left_out > 0) {
      const MetricEnergy positive = positive_part(tangent, elements_->rest(e));
      tangent.gradient = (1 - left_out) * tangent.gradient + left_out * positive.gradient;
      tangent.hessian = (1 - left_out) * tangent.hessian + left_out * positive.hessian;
    }
    const Eigen::Vector3d scale(2, 1, 2);
    int k = 0;
    for (int i = 0; i < 3; ++i) {
      batch.spread[i][lane] = scale[i] * tangent.gradient[i];
      for (int j = i; j < 3; ++j) {
        batch.coupling[k++][lane] = scale[i] * scale[j] * tangent.hessian(i, j);
      }
    }
    batch.load[lane] = pressure.empty() ? 0 : pressure[e] / 6;
  }
}

void MetricStiffness::add_product(double factor, const double* w, double* result) const {
  static const PetscLogEvent event = log_event("PrismProduct");
  // w12 and w13, s, q, the load, both rows of the stiffness, the corners, and the sums of the vertices.
  constexpr double by_element = 6 + 21 + 15 + 25 + 48 + 12 + 9;
  const LogScope scope(event, by_element * static_cast<double>(elements_->membrane().triangles.size()));
  static const Multiply multiply_fast = fastest_multiply();
  multiply_fast(batches_.data(), batches_.size(), factor, w, result);
}

void MetricStiffness::add_blocks(double factor, const HessianBlocks& blocks) const {
  const std::size_t elements = elements_->membrane().triangles.size();
  static const PetscLogEvent event = log_event("PrismBlocks");
  // The load's two blocks, b22, b23 and b33 with their diagonals, the six blocks of corners 2 and 3, the three of
  // corner 1, their factor, and the sums of the matrix.
  const bool whole = blocks.wants_off_diagonal();
  const double by_element = 2 * 9 + 3 * (45 + 3) + (whole ? 72 + 3 * 9 + 81 + 81 : 36 + 9 + 27 + 27);
  const LogScope scope(event, by_element * static_cast<double>(elements));
  for (std::size_t e = 0; e < elements; ++e) {
    add_element(batches_[e / lanes], e % lanes, factor, 9 * e, whole, blocks);
  }
}

}  // namespace pellicle::prism
