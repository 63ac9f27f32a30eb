// STREAM's triad: what memory and caches give one rank. `best_GB_per_s` is of the fastest pass; all in CPU time, to
// which other work on the machine adds least.
//
//     build/release/tests/benchmark_pellicle --benchmark_filter=triad

#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <string>

#include "tests/benchmark/triad.h"

namespace pellicle {
namespace {

void triad(benchmark::State& state, std::size_t megabytes) {
  Triad arrays(megabytes * 1000000);
  const auto cpu_seconds = [] {
    std::timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  };
  double best = 1e30;
  for (auto _ : state) {
    const double start = cpu_seconds();
    arrays.run();
    best = std::min(best, cpu_seconds() - start);
  }
  state.SetBytesProcessed(static_cast<int64_t>(arrays.bytes()) * state.iterations());
  state.counters["best_GB_per_s"] = 1e-9 * arrays.bytes() / best;
}

[[maybe_unused]] const bool triad_registered = [] {
  for (const std::size_t megabytes : {1, 10, 100, 1000}) {
    benchmark::RegisterBenchmark(("triad/MB:" + std::to_string(megabytes)).c_str(), triad, megabytes)
        ->Unit(benchmark::kMillisecond)
        ->MinTime(1);
  }
  return true;
}();

}  // namespace
}  // namespace pellicle
