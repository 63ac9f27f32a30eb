#pragma once

#include <mpi.h>

#include <vector>

#include "parallel/records.h"

namespace pellicle::parallel {

/// Sends items to chosen ranks, and answers back. Arriving items are in the order of the sending ranks, and within a
/// rank in that rank's order.
class Route {
 public:
  /// Collective.
  /// @param destinations rank to which each item of this rank goes
  Route(MPI_Comm comm, const std::vector<int>& destinations);

  /// The sending rank of each arriving item.
  const std::vector<int>& sources() const { return sources_; }

  /// Sends the items' records, of equal size on all ranks. Collective.
  Records send(const Records& records) const;
  /// Sends records of the arrived items back to their origins. Collective.
  /// @returns in the order of the destinations
  Records send_back(const Records& records) const;

  /// Sends values of a plain type.
  template <class Value>
  std::vector<Value> send(const std::vector<Value>& values) const {
    return send(Records::of(values)).template as<Value>();
  }
  template <class Value>
  std::vector<Value> send_back(const std::vector<Value>& values) const {
    return send_back(Records::of(values)).template as<Value>();
  }

 private:
  /// Number of items of each rank, and the first of each rank.
  struct Counts {
    std::vector<int> count;
    std::vector<int> begin;
    explicit Counts(std::vector<int> of_ranks);
  };
  Records exchange(const Records& records, const Counts& from, const Counts& to) const;

  MPI_Comm comm_;
  std::vector<PetscInt> order_;  ///< the items by destination
  Counts sent_{{}};
  Counts received_{{}};
  std::vector<int> sources_;
};

}  // namespace pellicle::parallel
