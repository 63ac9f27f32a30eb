#include "surface/split_corners.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "parallel/collective.h"

namespace pellicle {
inline namespace surface {

namespace {

/// The cells round a corner, in the order of their ids, so that all ranks that hold them find the same.
class Fan {
 public:
  /// @param cells local ones, with the place of the corner in each
  Fan(const Sheet& sheet, const Living& living, std::vector<std::pair<PetscInt, std::size_t>> cells)
      : cells_(std::move(cells)) {
    std::sort(cells_.begin(), cells_.end(), [&sheet](const auto& a, const auto& b) {
      return sheet.element_id[static_cast<std::size_t>(a.first)] < sheet.element_id[static_cast<std::size_t>(b.first)];
    });
    std::vector<std::size_t> joined_to(cells_.size());
    std::iota(joined_to.begin(), joined_to.end(), 0);
    std::vector<bool> lives(cells_.size(), false);
    std::map<PetscInt, std::vector<std::size_t>> at_neighbour;  // cells with a side that holds, by its other end
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const auto& [cell, place] = cells_[i];
      for (const std::size_t turn : {1, 3}) {
        const auto side = static_cast<std::size_t>(4 * cell) + (turn == 1 ? place : (place + 3) % 4);
        const PetscInt neighbour = sheet.cells[static_cast<std::size_t>(cell)][(place + turn) % 4];
        if (living.triangles[side]) {
          lives[i] = true;
          if (!living.cracked[side]) {
            at_neighbour[neighbour].push_back(i);
          }
        }
      }
    }
    const auto root = [&joined_to](std::size_t i) {
      while (joined_to[i] != i) {
        i = joined_to[i];
      }
      return i;
    };
    for (const auto& [neighbour, members] : at_neighbour) {
      for (const std::size_t member : members) {
        const std::size_t a = root(members.front());
        const std::size_t b = root(member);
        joined_to[std::max(a, b)] = std::min(a, b);
      }
    }
    std::map<std::size_t, std::size_t> group_of_root;  // in the order of the lowest cells
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (lives[i]) {
        group_of_root.emplace(root(i), group_of_root.size());
      }
    }
    mass_.assign(std::max<std::size_t>(1, group_of_root.size()), 0);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      group_.push_back(lives[i] ? group_of_root.at(root(i)) : 0);
      mass_[group_[i]] += sheet.element_mass[static_cast<std::size_t>(cells_[i].first)];
    }
  }

  std::size_t groups() const { return mass_.size(); }
  /// Of the masses of the cells those of a group have.
  double share(std::size_t group) const { return mass_[group] / std::accumulate(mass_.begin(), mass_.end(), 0.0); }
  /// Calls `visit(cell, place, group)` for each cell, with the place of the corner in it.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      visit(cells_[i].first, cells_[i].second, group_[i]);
    }
  }

 private:
  std::vector<std::pair<PetscInt, std::size_t>> cells_;
  std::vector<std::size_t> group_;  ///< of each cell
  std::vector<double> mass_;        ///< of the cells of each group [kg]
};

/// The fans that have fallen apart, by their local corners: those of owned corners and of owned cells.
std::map<PetscInt, Fan> parted_fans(const Sheet& sheet, const Living& living) {
  std::map<PetscInt, std::vector<std::pair<PetscInt, std::size_t>>> cells_at;
  for (std::size_t side = 0; side < living.cracked.size(); ++side) {
    if (living.cracked[side]) {
      cells_at[sheet.cells[side / 4][side % 4]];
      cells_at[sheet.cells[side / 4][(side + 1) % 4]];
    }
  }
  std::map<PetscInt, Fan> fans;
  if (cells_at.empty()) {
    return fans;
  }
  std::vector<bool> is_complete(static_cast<std::size_t>(sheet.particles.local()), false);
  std::fill_n(is_complete.begin(), sheet.owned_corners, true);
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    for (std::size_t place = 0; place < 4; ++place) {
      const PetscInt corner = sheet.cells[cell][place];
      if (static_cast<PetscInt>(cell) < sheet.elements.owned) {
        is_complete[static_cast<std::size_t>(corner)] = true;  // by the layers of neighbours' cells
      }
      if (const auto found = cells_at.find(corner); found != cells_at.end()) {
        found->second.emplace_back(static_cast<PetscInt>(cell), place);
      }
    }
  }
  for (auto& [corner, cells] : cells_at) {
    if (is_complete[static_cast<std::size_t>(corner)]) {
      Fan fan(sheet, living, std::move(cells));
      if (fan.groups() > 1) {
        fans.emplace(corner, std::move(fan));
      }
    }
  }
  return fans;
}

}  // namespace

SplitCorners find_split_corners(const Sheet& sheet, const Living& living) {
  const std::map<PetscInt, Fan> fans = parted_fans(sheet, living);
  const auto id_of = [&sheet](PetscInt i) { return sheet.persistent_id[static_cast<std::size_t>(i)]; };
  SplitCorners split;
  std::vector<PetscInt> own;  // ids of corners, each as often as it gets a copy
  for (const auto& [corner, fan] : fans) {
    if (corner < sheet.owned_corners) {
      own.insert(own.end(), fan.groups() - 1, id_of(corner));
    }
  }
  std::vector<PetscInt> all = of_all_ranks(sheet.comm(), own);
  std::sort(all.begin(), all.end());
  split.count = static_cast<PetscInt>(all.size());
  split.id_end = sheet.id_end + split.count;
  const auto new_id = [&](PetscInt corner, std::size_t group) {
    const auto first = std::lower_bound(all.begin(), all.end(), id_of(corner)) - all.begin();
    return sheet.id_end + static_cast<PetscInt>(first) + static_cast<PetscInt>(group) - 1;
  };

  split.share.assign(static_cast<std::size_t>(sheet.owned_corners), 1);
  for (std::size_t cell = 0; cell < static_cast<std::size_t>(sheet.elements.owned); ++cell) {
    std::array<PetscInt, 4>& ids = split.cell_corners.emplace_back();
    std::transform(sheet.cells[cell].begin(), sheet.cells[cell].end(), ids.begin(), id_of);
  }
  for (const auto& entry : fans) {
    const PetscInt corner = entry.first;
    const Fan& fan = entry.second;
    if (corner < sheet.owned_corners) {
      split.share[static_cast<std::size_t>(corner)] = fan.share(0);
      for (std::size_t group = 1; group < fan.groups(); ++group) {
        split.copies.push_back({corner, new_id(corner, group), fan.share(group)});
      }
    }
    fan.for_each([&](PetscInt cell, std::size_t place, std::size_t group) {
      if (cell < sheet.elements.owned && group > 0) {
        split.cell_corners[static_cast<std::size_t>(cell)][place] = new_id(corner, group);
      }
    });
  }
  return split;
}

}  // namespace surface
}  // namespace pellicle
