#include "surface/split_corners.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <utility>

#include "base/disjoint_sets.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"

namespace pellicle {
inline namespace surface {

namespace {

/// The elements round a corner, in the order of their ids.
class Fan {
 public:
  /// @param elements local ones, with the place of the corner in each
  Fan(const Surface& surface, const ActiveSet& active, std::vector<std::pair<PetscInt, std::size_t>> elements)
      : elements_(std::move(elements)) {
    std::sort(elements_.begin(), elements_.end(), [&surface](const auto& a, const auto& b) {
      return surface.element_id[a.first] < surface.element_id[b.first];
    });
    DisjointSets joined(elements_.size());
    std::vector<bool> lives(elements_.size(), false);
    std::map<PetscInt, std::vector<std::size_t>> at_neighbour;  // elements with a side that holds, by its other end
    const auto last = static_cast<std::size_t>(surface.sides_per_element()) - 1;
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      const std::size_t element = elements_[i].first;
      const std::size_t place = elements_[i].second;
      for (const std::size_t turn : {std::size_t{1}, last}) {
        const std::size_t side = (last + 1) * element + (turn == 1 ? place : (place + last) % (last + 1));
        if (active.triangles[surface.triangle_at(side)]) {
          lives[i] = true;
          if (!active.cracked[side]) {
            at_neighbour[surface.corner(element, (place + turn) % (last + 1))].push_back(i);
          }
        }
      }
    }
    for (const auto& [neighbour, members] : at_neighbour) {
      for (const std::size_t member : members) {
        joined.unite(members.front(), member);
      }
    }
    std::map<std::size_t, std::size_t> group_of_root;  // in the order of the lowest elements
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      if (lives[i]) {
        group_of_root.emplace(joined.find(i), group_of_root.size());
      }
    }
    mass_.assign(std::max<std::size_t>(1, group_of_root.size()), 0);
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      group_.push_back(lives[i] ? group_of_root.at(joined.find(i)) : 0);
      mass_[group_[i]] += surface.element_mass[elements_[i].first];
    }
  }

  std::size_t groups() const { return mass_.size(); }
  /// Share of a group in the elements' masses.
  double fraction(std::size_t group) const { return mass_[group] / std::accumulate(mass_.begin(), mass_.end(), 0.0); }
  /// Calls `visit(cell, place, group)` for each element, with the place of the corner in it.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      visit(elements_[i].first, elements_[i].second, group_[i]);
    }
  }

 private:
  std::vector<std::pair<PetscInt, std::size_t>> elements_;
  std::vector<std::size_t> group_;  ///< of each element
  std::vector<double> mass_;        ///< of the elements of each group [kg]
};

/// The elements round each owned corner at which they form several groups; all these elements are local.
std::map<PetscInt, Fan> parted_fans(const Surface& surface, const ActiveSet& active) {
  std::map<PetscInt, std::vector<std::pair<PetscInt, std::size_t>>> elements_at;
  const std::size_t sides = surface.sides_per_element();
  for (std::size_t side = 0; side < active.cracked.size(); ++side) {
    if (active.cracked[side]) {
      elements_at[surface.corner(side / sides, side % sides)];
      elements_at[surface.corner(side / sides, side % sides + 1)];
    }
  }
  elements_at.erase(elements_at.lower_bound(surface.particles.owned), elements_at.end());
  std::map<PetscInt, Fan> fans;
  if (elements_at.empty()) {
    return fans;
  }
  for (PetscInt element = 0; element < surface.elements.local(); ++element) {
    for (std::size_t place = 0; place < sides; ++place) {
      const auto found = elements_at.find(surface.corner(element, place));
      if (found != elements_at.end()) {
        found->second.emplace_back(element, place);
      }
    }
  }
  for (auto& [corner, elements] : elements_at) {
    Fan fan(surface, active, std::move(elements));
    if (fan.groups() > 1) {
      fans.emplace(corner, std::move(fan));
    }
  }
  return fans;
}

}  // namespace

SplitCorners find_split_corners(const Surface& surface, const ActiveSet& active) {
  const std::map<PetscInt, Fan> fans = parted_fans(surface, active);
  const auto id_of = [&surface](PetscInt i) { return surface.persistent_id[i]; };
  SplitCorners split;
  std::vector<PetscInt> own;  // ids of corners, each as often as it gets a copy
  for (const auto& [corner, fan] : fans) {
    own.insert(own.end(), fan.groups() - 1, id_of(corner));
  }
  std::vector<PetscInt> all = of_all_ranks(surface.comm(), own);
  std::sort(all.begin(), all.end());
  split.count = static_cast<PetscInt>(all.size());
  split.id_end = surface.id_end + split.count;
  if (split.count == 0) {
    return split;
  }

  split.fraction.assign(surface.particles.owned, 1);
  constexpr PetscInt same = -1;
  constexpr std::array<PetscInt, 4> none{same, same, same, same};
  std::vector<std::array<PetscInt, 4>> new_ids(surface.elements.local(), none);
  for (const auto& entry : fans) {
    const PetscInt corner = entry.first;
    const Fan& fan = entry.second;
    const auto first = std::lower_bound(all.begin(), all.end(), id_of(corner)) - all.begin();
    const auto new_id = [&](std::size_t group) {
      return surface.id_end + static_cast<PetscInt>(first) + static_cast<PetscInt>(group) - 1;
    };
    split.fraction[corner] = fan.fraction(0);
    for (std::size_t group = 1; group < fan.groups(); ++group) {
      split.copies.push_back({corner, new_id(group), fan.fraction(group)});
    }
    fan.for_each([&](PetscInt element, std::size_t place, std::size_t group) {
      if (group > 0) {
        new_ids[element][place] = new_id(group);
      }
    });
  }
  // The owner of a corner need not own the elements at it.
  surface.elements.exchange()->combine(RowType(MPIU_INT, 4), sizeof(none), MPI_MAX, new_ids.data());
  for (PetscInt element = 0; element < surface.elements.owned; ++element) {
    for (PetscInt place = 0; place < surface.sides_per_element(); ++place) {
      const PetscInt id = new_ids[element][place];
      split.cell_corners.push_back(id == same ? id_of(surface.corner(element, place)) : id);
    }
  }
  return split;
}

}  // namespace surface
}  // namespace pellicle
