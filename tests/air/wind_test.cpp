#include "air/wind.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"

namespace pellicle {
namespace {

using Eigen::Vector3d;

WindOptions gusty(int seed) {
  WindOptions options;
  options.velocity = {{0, 2, 0, 0}};
  options.turbulence = 0.3;
  options.length = 0.2;
  options.seed = seed;
  return options;
}

TEST(Wind, FollowsItsKeyPoints) {
  WindOptions options;
  options.velocity = {{1, 2, 0, -1}, {3, 6, 4, -1}};
  Wind wind(options);
  for (const double time : {0.0, 1.0, 1.5, 3.0, 7.0}) {
    const double fraction = std::min(1.0, std::max(0.0, (time - 1) / 2));
    wind.set_time(time);
    EXPECT_LE((wind.at({3, 1, 4}) - Vector3d(2 + 4 * fraction, 4 * fraction, -1)).norm(), 1e-14) << time;
  }
}

TEST(Wind, StillWithoutKeyPoints) {
  Wind wind{WindOptions()};
  wind.set_time(3);
  EXPECT_EQ(wind.at({1, 2, 3}), Vector3d::Zero());
}

TEST(Wind, RefusesRowsThatAreNoKeyPoints) {
  for (const Rows& rows : {Rows{{0, 1, 2}}, Rows{{0, 1, 2, 3}, {0, 1, 2, 3}}}) {
    WindOptions options;
    options.velocity = rows;
    try {
      const Wind wind(options);
      FAIL() << "expected an Error";
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find("force.wind.velocity: key point "), 0U) << error.what();
    }
  }
}

/// Mean and covariance of the fluctuations over a box much larger than their length.
struct Statistics {
  Vector3d mean = Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

Statistics statistics(const Wind& wind) {
  Statistics sums;
  constexpr int count = 24;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      for (int k = 0; k < count; ++k) {
        // Not a lattice: the numbers are prime to each other.
        const Vector3d u = wind.at({0.7309 * i + 0.1 * j, 0.6131 * j - 0.2 * k, 0.5477 * k}) - wind.mean();
        sums.mean += u;
        sums.covariance += u * u.transpose();
      }
    }
  }
  const double points = std::pow(count, 3);
  return {sums.mean / points, sums.covariance / points};
}

TEST(Wind, FluctuationsHaveMeanZeroAndTheStrengthAskedFor) {
  constexpr double rms = 0.3 * 2;
  Vector3d over_seeds = Vector3d::Zero();
  constexpr int seeds = 20;
  for (int seed = 0; seed < seeds; ++seed) {
    const Statistics of_seed = statistics(Wind(gusty(seed)));
    EXPECT_LE(of_seed.mean.norm(), 0.05 * rms) << seed;
    EXPECT_NEAR(std::sqrt(of_seed.covariance.trace() / 3), rms, 0.03 * rms) << seed;
    over_seeds += of_seed.covariance.diagonal() / seeds;
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(std::sqrt(over_seeds[k]), rms, 0.1 * rms) << "of component " << k;
  }
}

TEST(Wind, FluctuationsAreCorrelatedOverTheirLength) {
  constexpr double length = 0.2;
  for (const double distance : {0.5 * length, length, 2 * length}) {
    double sum = 0;
    double square = 0;
    for (int seed = 0; seed < 400; ++seed) {
      const Wind wind(gusty(seed));
      for (int k = 0; k < 20; ++k) {
        const Vector3d x(3.1 * k, -1.7 * k, 0.9 * k);
        const double here = wind.at(x)[1];
        sum += here * wind.at(x + distance * Vector3d::UnitY())[1];
        square += here * here;
      }
    }
    EXPECT_NEAR(sum / square, std::exp(-M_PI / 4 * std::pow(distance / length, 2)), 0.06) << distance;
  }
}

TEST(Wind, FluctuationsAreFreeOfDivergence) {
  const Wind wind(gusty(3));
  const Vector3d x(0.1, 0.2, 0.3);
  constexpr double d = 1e-5;
  double divergence = 0;
  double size = 0;
  for (int k = 0; k < 3; ++k) {
    const Vector3d slope = (wind.at(x + d * Vector3d::Unit(k)) - wind.at(x - d * Vector3d::Unit(k))) / (2 * d);
    divergence += slope[k];
    size += slope.norm();
  }
  EXPECT_GT(size, 1);
  EXPECT_LE(std::abs(divergence), 1e-7 * size);
}

TEST(Wind, MeanCarriesTheFluctuationsAlong) {
  WindOptions options = gusty(1);
  options.velocity = {{0, 1, 0, 0}, {1, 3, 0, 2}};
  Wind early(options);
  Wind late(options);
  early.set_time(0.5);  // 2, 0, 1
  late.set_time(1);     // 3, 0, 2
  const Vector3d displacement(2.5 * 0.5, 0, 1.5 * 0.5);
  const Vector3d x(0.3, -0.4, 0.2);
  const Vector3d before = (early.at(x) - early.mean()) / early.mean().norm();
  const Vector3d after = (late.at(x + displacement) - late.mean()) / late.mean().norm();
  EXPECT_GT(before.norm(), 0.01);
  EXPECT_LE((before - after).norm(), 1e-12);
}

TEST(Wind, IsTheSameForASeedAndAnotherForOthers) {
  const Vector3d x(0.3, -0.4, 0.2);
  EXPECT_EQ(Wind(gusty(5)).at(x), Wind(gusty(5)).at(x));
  EXPECT_GT((Wind(gusty(5)).at(x) - Wind(gusty(6)).at(x)).norm(), 1e-3);
}

}  // namespace
}  // namespace pellicle
