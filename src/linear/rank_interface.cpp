#include "linear/rank_interface.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/sorting.h"

namespace pellicle::linear {

RankInterface::RankInterface(MPI_Comm comm, PetscInt first, PetscInt owned, const std::vector<PetscInt>& later)
    : comm_(comm), first_(first), rows_(without_repeats(of_all_ranks(comm, later))) {
  auto next = std::lower_bound(rows_.begin(), rows_.end(), first);
  own_first_ = static_cast<int>(next - rows_.begin());
  for (PetscInt i = 0; i < owned; ++i) {
    const bool is_inner = next == rows_.end() || *next != first + i;
    auto& kind = is_inner ? inner_ : own_;
    number_.push_back(is_inner ? static_cast<int>(inner_.size()) : -1 - static_cast<int>(next++ - rows_.begin()));
    kind.push_back(i);
  }
}

int RankInterface::number(PetscInt row) const {
  if (row < first_ + static_cast<PetscInt>(number_.size())) {
    return std::max(-1, -1 - number_[row - first_]);
  }
  return static_cast<int>(std::lower_bound(rows_.begin(), rows_.end(), row) - rows_.begin());
}

void RankInterface::set_border(std::vector<int> border, int width) {
  border_ = std::move(border);
  width_ = width;
  std::vector<int> loaded(own_.size());
  std::iota(loaded.begin(), loaded.end(), own_first_);
  loaded.insert(loaded.end(), border_.begin(), border_.end());
  loads_.resize(static_cast<std::size_t>(width) * loaded.size());
  gatherer_ = Gatherer(comm_, loads_.size());
  loaded_ = of_all_ranks(comm_, loaded);
}

void RankInterface::sum(const double* own, const double* on_border, Eigen::VectorXd& result) {
  auto to = loads_.begin();
  for (const PetscInt i : own_) {
    to = std::copy_n(own + width_ * i, width_, to);
  }
  std::copy_n(on_border, static_cast<std::size_t>(width_) * border_.size(), to);
  gatherer_.gather(loads_.data(), all_loads_);
  result.setZero(static_cast<Eigen::Index>(width_) * size());
  const double* load = all_loads_.data();
  for (const int row : loaded_) {
    for (int c = 0; c < width_; ++c) {
      result[width_ * row + c] += *load++;
    }
  }
}

}  // namespace pellicle::linear
