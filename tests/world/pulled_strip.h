#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "parallel/collective.h"
#include "tests/support/csv.h"
#include "tests/world/one_object.h"

namespace pellicle {

/// A strip of a sheet or a wall that is drawn out along y, in steps of one length.
class PulledStrip {
 public:
  PulledStrip(const SurfaceMesh& mesh, const Options& options, double h, ChainKind chain = ChainKind::burn)
      : h_(h), run_(mesh, options, chain) {
    run_.begin();
  }

  void step() {
    const StepResult result = run_.world().step(h_);
    ASSERT_TRUE(result.converged) << result.reason;
    run_.record(0);
  }
  /// Steps until something has cracked. @returns when [s]
  double first_crack(double latest) {
    while (cracked_sides() == 0 && run_.time() < latest && !::testing::Test::HasFatalFailure()) {
      step();
    }
    return run_.time();
  }

  double time() const { return run_.time(); }
  Object& object() { return run_.object(); }
  State& state() { return run_.state(); }
  const Surface& surface() { return run_.object().surface(); }
  BurningFields& fields() { return *state().burning; }
  static double sum(double own) {
    MPI_Allreduce(MPI_IN_PLACE, &own, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return own;
  }
  double cracked_sides() { return sum(fields().cracked_sides); }
  /// Of the owned particles of all ranks.
  double sum_of(const double* values) {
    double own = 0;
    for (PetscInt i = 0; i < surface().particles.owned; ++i) {
      own += values[i];
    }
    return sum(own);
  }
  double mass() { return sum_of(fields().mass.data()); }
  double initial_mass() { return sum_of(surface().initial_mass.data()); }
  /// Of the owned particles of all ranks.
  std::vector<PetscInt> all_of(const std::vector<PetscInt>& local) {
    return of_all_ranks(PETSC_COMM_WORLD,
                        std::vector<PetscInt>(local.begin(), local.begin() + surface().particles.owned));
  }
  std::vector<PetscInt> ids() { return all_of(surface().persistent_id); }
  /// Least and greatest y of a piece's particles.
  std::array<double, 2> extent(PetscInt piece) {
    std::array<double, 2> ends{-HUGE_VAL, -HUGE_VAL};
    for (PetscInt i = 0; i < surface().particles.owned; ++i) {
      if (fields().pieces.of_particle[i] == piece) {
        const double y = state().position.vector(i).y();
        ends = {std::max(ends[0], -y), std::max(ends[1], y)};
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, ends.data(), 2, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
    return {-ends[0], ends[1]};
  }

  /// It has parted half-way up: each half has half of the mass, and has sprung back to half of the length; the gap is
  /// what the upper end has moved.
  /// @param earliest time of the parting, before `latest` [s] @param fraction of what the upper end has moved: how near
  void expect_halves(double mass, double length, double earliest, double latest, double moved, double fraction) {
    const Pieces& pieces = fields().pieces;
    ASSERT_EQ(pieces.present.size(), 2U);
    EXPECT_GE(pieces.birth_time[1], earliest);
    EXPECT_LE(pieces.birth_time[1], latest);
    for (const double piece : piece_masses(pieces, surface(), fields().mass)) {
      EXPECT_NEAR(piece, mass / 2, 1e-12 * mass);
    }
    std::array<double, 2> lower = extent(pieces.present[0]);
    std::array<double, 2> upper = extent(pieces.present[1]);
    if (lower[0] > upper[0]) {
      std::swap(lower, upper);
    }
    EXPECT_NEAR(lower[1], length / 2, fraction / 2 * moved);
    EXPECT_NEAR(upper[0] - lower[1], moved, fraction * moved);
  }

 private:
  double h_;
  OneObject run_;
};

/// What a history says of a strip that has cracked across. Collective.
inline void expect_crack_in_history(const std::string& folder, double sides, double length) {
  MPI_Barrier(PETSC_COMM_WORLD);
  const auto history = read_csv(folder + "/history.csv");
  EXPECT_EQ(history.at("cracked_sides").front(), 0);
  EXPECT_EQ(history.at("cracked_sides").back(), sides);
  EXPECT_NEAR(history.at("crack_length").back(), length, 1e-12);
  EXPECT_EQ(history.at("pieces").back(), 2);
}

}  // namespace pellicle
