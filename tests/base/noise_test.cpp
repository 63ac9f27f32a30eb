#include "base/noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace pellicle {
namespace {

/// Places all over a large box that lies on both sides of the origin.
Eigen::Vector3d place(std::uint64_t n) {
  return 1000 * Eigen::Vector3d(noise(9, 3 * n), noise(9, 3 * n + 1), noise(9, 3 * n + 2));
}

/// Largest difference between the fraction of the numbers below a bound and that of a uniform number in [-1, 1].
double distance_from_uniform(std::vector<double> numbers) {
  std::sort(numbers.begin(), numbers.end());
  double distance = 0;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const double fraction = (static_cast<double>(k) + 0.5) / static_cast<double>(numbers.size());
    distance = std::max(distance, std::abs((numbers[k] + 1) / 2 - fraction));
  }
  return distance;
}

TEST(NoiseField, IsUniformOverPlacesAndOverSeeds) {
  constexpr int count = 4000;
  const double limit = 1.95 / std::sqrt(count);  // Kolmogorov and Smirnov: one sample in a thousand is further away
  std::vector<double> numbers(count);
  for (int n = 0; n < count; ++n) {
    numbers[n] = noise(1, place(static_cast<std::uint64_t>(n)));
  }
  EXPECT_LT(distance_from_uniform(numbers), limit);
  // In a lattice's points, between two, and anywhere; the seeds of users follow on each other.
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-3.5, 2, 7), Eigen::Vector3d(0.31, -8.77, 0.5)}) {
    for (int seed = 0; seed < count; ++seed) {
      numbers[seed] = noise(seed, at);
    }
    EXPECT_LT(distance_from_uniform(numbers), limit) << at.transpose();
  }
}

TEST(NoiseField, VariesOverItsLength) {
  constexpr int count = 4000;
  const auto correlation_with = [](const auto& step_of) {
    double sum = 0;
    for (std::uint64_t n = 0; n < count; ++n) {
      const Eigen::Vector3d at = place(n);
      sum += 3 * noise(4, at) * noise(4, Eigen::Vector3d(at + step_of(n)));
    }
    return sum / count;
  };
  const auto correlation = [&](double distance) {
    return correlation_with(
        [&](std::uint64_t n) -> Eigen::Vector3d { return distance * place(n + count).normalized(); });
  };
  constexpr double error = 0.05;  // three standard deviations
  EXPECT_NEAR(correlation(0), 1, error);
  EXPECT_NEAR(correlation(0.5), 2 / 3.0, error);
  EXPECT_NEAR(correlation(1), 0.2, error);
  EXPECT_NEAR(correlation(2), 0, error);
  // The noise does not repeat itself along any axis: neither after 2^32, the range of a 32-bit number, nor after 2^49,
  // half of the largest coordinate.
  for (const double far : {0x1p32, 0x1p49}) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(correlation_with([&](std::uint64_t) -> Eigen::Vector3d { return far * Eigen::Vector3d::Unit(axis); }),
                  0, error)
          << far << " " << axis;
    }
  }
}

TEST(NoiseField, IsSmoothAlsoAcrossThePlanesOfItsLattice) {
  for (std::uint64_t n = 0; n < 200; ++n) {
    Eigen::Vector3d at = place(n);
    at[static_cast<Eigen::Index>(n % 3)] = std::floor(at[0]);
    const Eigen::Vector3d step = 1e-6 * Eigen::Vector3d::Ones();
    EXPECT_NEAR(noise(2, Eigen::Vector3d(at + step)), noise(2, Eigen::Vector3d(at - step)), 1e-4);
  }
}

}  // namespace
}  // namespace pellicle
