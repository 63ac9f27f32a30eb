#pragma once

#include <mpi.h>

#include <numeric>
#include <string>
#include <vector>

namespace pellicle {
inline namespace parallel {

/// How the ranks share an amount.
struct RankShares {
  double sum = 0;
  double imbalance = 1;  ///< the largest share over the mean; 1 if there is nothing to share
};

/// @param own share of this rank, 0 or more. Collective.
inline RankShares shares_of_ranks(MPI_Comm comm, double own) {
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  double largest = own;
  MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, comm);
  MPI_Allreduce(MPI_IN_PLACE, &own, 1, MPI_DOUBLE, MPI_SUM, comm);
  return {own, own > 0 ? largest * ranks / own : 1};
}

/// Whether something is so on any rank. Collective.
inline bool on_any_rank(MPI_Comm comm, bool here) {
  MPI_Allreduce(MPI_IN_PLACE, &here, 1, MPI_CXX_BOOL, MPI_LOR, comm);
  return here;
}

/// Gives rank 0's text to every rank. Collective.
inline void broadcast(MPI_Comm comm, std::string& text) {
  auto length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, comm);
  text.resize(length);
  MPI_Bcast(text.data(), length, MPI_CHAR, 0, comm);
}

/// Values of any plain type of all ranks, rank after rank. Collective.
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

/// Values of all ranks, rank after rank, again and again: how many each rank has stays.
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

  /// Collective. @param all is resized
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
