#pragma once

#include <mpi.h>

#include <Eigen/Core>
#include <array>
#include <numeric>
#include <string>
#include <type_traits>
#include <vector>

namespace pellicle {
inline namespace parallel {

/// MPI's type of a C++ type of numbers. PetscInt is one of the integers, depending on PETSc's configuration.
template <class Number>
MPI_Datatype mpi_type() {
  if constexpr (std::is_same_v<Number, double>) {
    return MPI_DOUBLE;
  } else if constexpr (std::is_same_v<Number, int>) {
    return MPI_INT;
  } else if constexpr (std::is_same_v<Number, long>) {
    return MPI_LONG;
  } else {
    static_assert(std::is_same_v<Number, long long>);
    return MPI_LONG_LONG;
  }
}

/// Replaces each value by the reduction of the values at its place on all ranks. Collective.
template <class Number>
void reduce_over_ranks(MPI_Comm comm, Number* values, std::size_t count, MPI_Op operation) {
  MPI_Allreduce(MPI_IN_PLACE, values, static_cast<int>(count), mpi_type<Number>(), operation, comm);
}

/// The sum of a number, or of each number of an array, over all ranks. Collective.
template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
[[nodiscard]] Number sum_over_ranks(MPI_Comm comm, Number value) {
  reduce_over_ranks(comm, &value, 1, MPI_SUM);
  return value;
}
template <class Number, std::size_t count>
[[nodiscard]] std::array<Number, count> sum_over_ranks(MPI_Comm comm, std::array<Number, count> values) {
  reduce_over_ranks(comm, values.data(), count, MPI_SUM);
  return values;
}
/// Replaces each value by the sum of the values at its place on all ranks, which pass equally many. Collective.
template <class Number>
void sum_over_ranks(MPI_Comm comm, std::vector<Number>& values) {
  reduce_over_ranks(comm, values.data(), values.size(), MPI_SUM);
}
template <class Derived>
void sum_over_ranks(MPI_Comm comm, Eigen::PlainObjectBase<Derived>& values) {
  reduce_over_ranks(comm, values.data(), static_cast<std::size_t>(values.size()), MPI_SUM);
}

/// The largest value of a number, or of each number of an array, over all ranks. Collective.
template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
[[nodiscard]] Number max_over_ranks(MPI_Comm comm, Number value) {
  reduce_over_ranks(comm, &value, 1, MPI_MAX);
  return value;
}
template <class Number, std::size_t count>
[[nodiscard]] std::array<Number, count> max_over_ranks(MPI_Comm comm, std::array<Number, count> values) {
  reduce_over_ranks(comm, values.data(), count, MPI_MAX);
  return values;
}
/// Replaces each value by the largest value of the values at its place on all ranks, which pass equally many.
/// Collective.
template <class Number>
void max_over_ranks(MPI_Comm comm, std::vector<Number>& values) {
  reduce_over_ranks(comm, values.data(), values.size(), MPI_MAX);
}
template <class Derived>
void max_over_ranks(MPI_Comm comm, Eigen::PlainObjectBase<Derived>& values) {
  reduce_over_ranks(comm, values.data(), static_cast<std::size_t>(values.size()), MPI_MAX);
}

/// The smallest value of a number, or of each number of an array, over all ranks. Collective.
template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
[[nodiscard]] Number min_over_ranks(MPI_Comm comm, Number value) {
  reduce_over_ranks(comm, &value, 1, MPI_MIN);
  return value;
}
template <class Number, std::size_t count>
[[nodiscard]] std::array<Number, count> min_over_ranks(MPI_Comm comm, std::array<Number, count> values) {
  reduce_over_ranks(comm, values.data(), count, MPI_MIN);
  return values;
}
/// Replaces each value by the smallest value of the values at its place on all ranks, which pass equally many.
/// Collective.
template <class Number>
void min_over_ranks(MPI_Comm comm, std::vector<Number>& values) {
  reduce_over_ranks(comm, values.data(), values.size(), MPI_MIN);
}
template <class Derived>
void min_over_ranks(MPI_Comm comm, Eigen::PlainObjectBase<Derived>& values) {
  reduce_over_ranks(comm, values.data(), static_cast<std::size_t>(values.size()), MPI_MIN);
}

/// Distribution of an amount over the ranks.
struct RankShares {
  double sum = 0;
  double imbalance = 1;  ///< the largest share over the mean; 1 if there is nothing to share
};

/// The distribution of the ranks' own shares. Collective. @param own fraction of this rank, 0 or more
inline RankShares shares_of_ranks(MPI_Comm comm, double own) {
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  const double largest = max_over_ranks(comm, own);
  const double sum = sum_over_ranks(comm, own);
  return {sum, sum > 0 ? largest * ranks / sum : 1};
}

/// Whether a condition holds on any rank. Collective.
inline bool on_any_rank(MPI_Comm comm, bool here) {
  MPI_Allreduce(MPI_IN_PLACE, &here, 1, MPI_CXX_BOOL, MPI_LOR, comm);
  return here;
}

/// Sends rank 0's text to every rank. Collective.
inline void broadcast(MPI_Comm comm, std::string& text) {
  auto length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, comm);
  text.resize(length);
  MPI_Bcast(text.data(), length, MPI_CHAR, 0, comm);
}

/// Gathers the values, of any plain type, of all ranks, rank after rank. Collective.
template <class Value>
std::vector<Value> of_all_ranks(MPI_Comm comm, const std::vector<Value>& own) {
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  const auto bytes = static_cast<int>(own.size() * sizeof(Value));
  std::vector<int> sizes(ranks);
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
  Gatherer(MPI_Comm comm, std::size_t own) : comm_(comm) {
    for (const int count : of_all_ranks(comm, std::vector<int>{static_cast<int>(own)})) {
      counts_.push_back(count);
      starts_.push_back(starts_.back() + count);
    }
    MPI_Comm_rank(comm, &rank_);
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

}  // namespace parallel
}  // namespace pellicle
