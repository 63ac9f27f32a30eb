#pragma once

#include <mpi.h>

#include <vector>

#include "parallel/records.h"

namespace pellicle {
inline namespace parallel {

/// Sends items to ranks of the caller's choice, and answers back. What arrives is in the order of the sending ranks,
/// and within a rank in that rank's own order.
class Route {
 public:
  /// Collective.
  /// @param destinations rank to which each item of this rank goes
  Route(MPI_Comm comm, const std::vector<int>& destinations);

  /// Items that arrive.
  PetscInt arrivals() const { return static_cast<PetscInt>(sources_.size()); }
  /// The rank that sends each of them.
  const std::vector<int>& sources() const { return sources_; }

  /// Sends the items' records, of as many bytes on all ranks. Collective.
  Records send(const Records& records) const;
  /// Sends records of the items that have arrived back to where they came from. Collective.
  /// @returns in the order of the destinations
  Records send_back(const Records& records) const;

  /// The same with values of a plain type.
  template <class Value>
  std::vector<Value> send(const std::vector<Value>& values) const {
    return send(Records::of(values)).template as<Value>();
  }
  template <class Value>
  std::vector<Value> send_back(const std::vector<Value>& values) const {
    return send_back(Records::of(values)).template as<Value>();
  }

 private:
  /// Items of each rank, and where those of a rank begin.
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

}  // namespace parallel
}  // namespace pellicle
