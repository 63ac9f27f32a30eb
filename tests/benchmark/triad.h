#pragma once

#include <benchmark/benchmark.h>
#include <petscmat.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>
#include <vector>

#include "base/error.h"
#include "base/handle.h"

namespace pellicle {

/// The three arrays of STREAM's triad, a = b + s c.
class Triad {
 public:
  /// @param bytes of all three
  explicit Triad(std::size_t bytes) : a_(bytes / 24, 1.0), b_(bytes / 24, 2.0), c_(bytes / 24, 3.0) {}

  /// Counted as STREAM counts them: without what is read of `a` before it is written.
  double bytes() const { return 24 * static_cast<double>(a_.size()); }

  void run() {
    for (std::size_t i = 0; i < a_.size(); ++i) {
      a_[i] = b_[i] + 0.3 * c_[i];
    }
    benchmark::DoNotOptimize(a_.data());
    benchmark::ClobberMemory();
  }

 private:
  std::vector<double> a_, b_, c_;
};

/// Bytes a second of the triad on this many bytes in all; the best of 40.
inline double triad_bandwidth(double bytes) {
  static std::map<double, double> known;
  const auto [place, is_new] = known.insert({bytes, 0});
  if (is_new) {
    Triad triad(static_cast<std::size_t>(bytes));
    for (int repeat = 0; repeat < 40; ++repeat) {
      const auto start = std::chrono::steady_clock::now();
      triad.run();
      const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
      place->second = std::max(place->second, triad.bytes() / seconds.count());
    }
  }
  return place->second;
}

/// Times products with a matrix. Counts the shortest, and its ratio to the triad's time on the bytes that a product has
/// to read and write.
inline void time_products(benchmark::State& state, Mat matrix, double bytes) {
  VecHandle in, out;
  check(MatCreateVecs(matrix, in.create(), out.create()));
  check(VecSet(in, 1));
  double best = 1e30;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    check(MatMult(matrix, in, out));
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    best = std::min(best, seconds.count());
  }
  state.counters["best_ms"] = 1e3 * best;
  state.counters["megabytes"] = 1e-6 * bytes;
  state.counters["triad_GB_per_s"] = 1e-9 * triad_bandwidth(bytes);
  state.counters["times_triad"] = best * triad_bandwidth(bytes) / bytes;
}

}  // namespace pellicle
