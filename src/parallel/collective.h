#pragma once

#include <mpi.h>

#include <array>
#include <numeric>
#include <type_traits>
#include <vector>

#include "base/error.h"

namespace pellicle::parallel {

// MPI's type of a number. PetscInt is one of the integers, depending on PETSc's configuration.
inline MPI_Datatype mpi_type(double) { return MPI_DOUBLE; }
inline MPI_Datatype mpi_type(int) { return MPI_INT; }
inline MPI_Datatype mpi_type(long) { return MPI_LONG; }
inline MPI_Datatype mpi_type(long long) { return MPI_LONG_LONG; }
template <class Other>
MPI_Datatype mpi_type(Other) = delete;

/// Whether a reduction returns its result: that of a number or array. Other values are replaced.
template <class Values>
constexpr bool is_returned = std::is_arithmetic_v<Values>;
template <class Number, std::size_t count>
constexpr bool is_returned<std::array<Number, count>> = true;

/// A reduction of the numbers at the same place on all ranks, which pass equally many.
class Reduction {
 public:
  explicit Reduction(MPI_Op operation) : operation_(operation) {}

  /// The reduction of a number, or of each number of an array. Collective.
  template <class Values>
  [[nodiscard]] std::enable_if_t<is_returned<Values>, Values> operator()(MPI_Comm comm, Values values) const {
    reduce(comm, values);
    return values;
  }
  /// Replaces each number of a vector or Eigen matrix by its reduction. Collective.
  template <class Values>
  std::enable_if_t<!is_returned<std::remove_const_t<Values>>> operator()(MPI_Comm comm, Values& values) const {
    reduce(comm, values);
  }

 private:
  template <class Values>
  void reduce(MPI_Comm comm, Values& values) const {
    if constexpr (std::is_arithmetic_v<Values>) {
      MPI_Allreduce(MPI_IN_PLACE, &values, 1, mpi_type(values), operation_, comm);
    } else {
      static_assert(std::is_default_constructible_v<Values>, "a view of a matrix may have gaps");
      const std::remove_pointer_t<decltype(values.data())> number{};
      MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), mpi_type(number), operation_, comm);
    }
  }

  MPI_Op operation_;
};

// The reductions that give the sum, the largest and the smallest number.
inline const Reduction sum_over_ranks{MPI_SUM};
inline const Reduction max_over_ranks{MPI_MAX};
inline const Reduction min_over_ranks{MPI_MIN};

/// Distribution of an amount over the ranks.
struct RankShares {
  double sum = 0;
  double imbalance = 1;  ///< the largest share over the mean; 1 if there is nothing to share
};

/// The distribution of the ranks' own shares. Collective. @param own fraction of this rank, 0 or more
inline RankShares shares_of_ranks(MPI_Comm comm, double own) {
  const double largest = max_over_ranks(comm, own);
  const double sum = sum_over_ranks(comm, own);
  return {sum, sum > 0 ? largest * ranks_of(comm) / sum : 1};
}

/// Whether a condition holds on any rank. Collective.
inline bool on_any_rank(MPI_Comm comm, bool here) {
  MPI_Allreduce(MPI_IN_PLACE, &here, 1, MPI_CXX_BOOL, MPI_LOR, comm);
  return here;
}

/// Gathers the values, of any plain type, of all ranks, rank after rank. Collective.
template <class Value>
std::vector<Value> of_all_ranks(MPI_Comm comm, const std::vector<Value>& own) {
  const auto bytes = static_cast<int>(own.size() * sizeof(Value));
  std::vector<int> sizes(ranks_of(comm));
  MPI_Allgather(&bytes, 1, MPI_INT, sizes.data(), 1, MPI_INT, comm);
  std::vector<int> starts(sizes.size() + 1, 0);
  std::partial_sum(sizes.begin(), sizes.end(), starts.begin() + 1);
  std::vector<Value> all(static_cast<std::size_t>(starts.back()) / sizeof(Value));
  MPI_Allgatherv(own.data(), bytes, MPI_BYTE, all.data(), sizes.data(), starts.data(), MPI_BYTE, comm);
  return all;
}

/// Gathers values of all ranks, rank after rank, repeatedly and with fixed numbers for each rank.
class Gatherer {
 public:
  Gatherer() = default;

  /// Collective. @param own number of this rank's values
  Gatherer(MPI_Comm comm, std::size_t own) : comm_(comm), rank_(rank_of(comm)) {
    for (const int count : of_all_ranks(comm, std::vector<int>{static_cast<int>(own)})) {
      counts_.push_back(count);
      starts_.push_back(starts_.back() + count);
    }
  }

  /// Gathers the values of all ranks. Collective. @param all is resized
  void gather(const double* own, std::vector<double>& all) const {
    all.resize(starts_.back());
    MPI_Allgatherv(own, counts_[rank_], MPI_DOUBLE, all.data(), counts_.data(), starts_.data(), MPI_DOUBLE, comm_);
  }

 private:
  MPI_Comm comm_ = MPI_COMM_NULL;
  int rank_ = 0;
  std::vector<int> counts_;  ///< of each rank
  std::vector<int> starts_ = {0};
};

}  // namespace pellicle::parallel
