#include "parallel/route.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/sorting.h"
#include "parallel/exchange.h"

namespace pellicle::parallel {

Route::Counts::Counts(std::vector<int> of_ranks) : count(std::move(of_ranks)), begin(count.size() + 1, 0) {
  std::partial_sum(count.begin(), count.end(), begin.begin() + 1);
}

Route::Route(MPI_Comm comm, const std::vector<int>& destinations)
    : comm_(comm), order_(numbers_up_to<PetscInt>(destinations.size())) {
  const auto destination = [&](PetscInt item) { return destinations[item]; };
  std::stable_sort(order_.begin(), order_.end(),
                   [&](PetscInt a, PetscInt b) { return destination(a) < destination(b); });
  std::vector<int> sent(ranks_of(comm), 0);
  for (const int rank : destinations) {
    ++sent[rank];
  }
  std::vector<int> received(sent.size());
  MPI_Alltoall(sent.data(), 1, MPI_INT, received.data(), 1, MPI_INT, comm);
  for (std::size_t rank = 0; rank < received.size(); ++rank) {
    sources_.insert(sources_.end(), static_cast<std::size_t>(received[rank]), static_cast<int>(rank));
  }
  sent_ = Counts(std::move(sent));
  received_ = Counts(std::move(received));
}

Records Route::exchange(const Records& records, const Counts& from, const Counts& to) const {
  Records received(records.bytes(), to.begin.back());
  if (records.bytes() > 0) {
    const RowType type(MPI_BYTE, static_cast<int>(records.bytes()));
    MPI_Alltoallv(records.at(0), from.count.data(), from.begin.data(), type, received.at(0), to.count.data(),
                  to.begin.data(), type, comm_);
  }
  return received;
}

Records Route::send(const Records& records) const { return exchange(records.of_items(order_), sent_, received_); }

Records Route::send_back(const Records& records) const {
  const Records sorted = exchange(records, received_, sent_);
  std::vector<PetscInt> place(order_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) {
    place[order_[i]] = static_cast<PetscInt>(i);
  }
  return sorted.of_items(place);
}

}  // namespace pellicle::parallel
