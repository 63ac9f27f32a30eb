#include "surface/split_corners.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <numeric>

#include "base/disjoint_sets.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"

namespace pellicle::surface {

namespace {

/// The elements round a corner, in the order of their ids.
struct Fan {
  struct Member {
    PetscInt element = 0;   ///< local
    std::size_t place = 0;  ///< of the corner in it
    std::size_t group = 0;
  };
  std::vector<Member> members;
  std::vector<double> mass;  ///< of the elements of each group [kg]

  /// Share of a group in the elements' masses.
  double fraction(std::size_t group) const { return mass[group] / std::accumulate(mass.begin(), mass.end(), 0.0); }
};

/// Sorts the elements of a fan and finds their groups.
void find_groups(Fan& fan, const Surface& surface, const ActiveSet& active) {
  std::vector<Fan::Member>& members = fan.members;
  std::sort(members.begin(), members.end(), [&surface](const Fan::Member& a, const Fan::Member& b) {
    return surface.element_id[a.element] < surface.element_id[b.element];
  });
  DisjointSets joined(members.size());
  std::vector<bool> lives(members.size(), false);
  std::map<PetscInt, std::size_t> at_neighbour;  // first element with a side that holds, by its other end
  const auto last = static_cast<std::size_t>(surface.sides_per_element()) - 1;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const std::size_t element = members[i].element;
    const std::size_t place = members[i].place;
    for (const std::size_t turn : {std::size_t{1}, last}) {
      const std::size_t side = (last + 1) * element + (turn == 1 ? place : (place + last) % (last + 1));
      if (active.triangles[surface.triangle_at(side)]) {
        lives[i] = true;
        if (!active.cracked[side]) {
          joined.unite(at_neighbour.try_emplace(surface.corner(element, place + turn), i).first->second, i);
        }
      }
    }
  }
  std::map<std::size_t, std::size_t> group_of_root;  // in the order of the lowest elements
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (lives[i]) {
      members[i].group = group_of_root.emplace(joined.find(i), group_of_root.size()).first->second;
    }
  }
  fan.mass.assign(std::max<std::size_t>(1, group_of_root.size()), 0);
  for (const Fan::Member& member : members) {
    fan.mass[member.group] += surface.element_mass[member.element];
  }
}

/// The elements round each owned corner at which they form several groups; all these elements are local.
std::map<PetscInt, Fan> parted_fans(const Surface& surface, const ActiveSet& active) {
  std::map<PetscInt, Fan> fans;
  const std::size_t sides = surface.sides_per_element();
  for (std::size_t side = 0; side < active.cracked.size(); ++side) {
    if (active.cracked[side]) {
      fans[surface.corner(side / sides, side % sides)];
      fans[surface.corner(side / sides, side % sides + 1)];
    }
  }
  fans.erase(fans.lower_bound(surface.particles.owned), fans.end());
  if (fans.empty()) {
    return fans;
  }
  for (PetscInt element = 0; element < surface.elements.local(); ++element) {
    for (std::size_t place = 0; place < sides; ++place) {
      const auto found = fans.find(surface.corner(element, place));
      if (found != fans.end()) {
        found->second.members.push_back({element, place});
      }
    }
  }
  for (auto fan = fans.begin(); fan != fans.end();) {
    find_groups(fan->second, surface, active);
    fan = fan->second.mass.size() > 1 ? std::next(fan) : fans.erase(fan);
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
    own.insert(own.end(), fan.mass.size() - 1, id_of(corner));
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
  for (const auto& [corner, fan] : fans) {
    const auto place = std::lower_bound(all.begin(), all.end(), id_of(corner)) - all.begin();
    const PetscInt first_id = surface.id_end + static_cast<PetscInt>(place);
    split.fraction[corner] = fan.fraction(0);
    for (std::size_t group = 1; group < fan.mass.size(); ++group) {
      split.copies.push_back({corner, first_id + static_cast<PetscInt>(group) - 1, fan.fraction(group)});
    }
    for (const Fan::Member& member : fan.members) {
      if (member.group > 0) {
        new_ids[member.element][member.place] = first_id + static_cast<PetscInt>(member.group) - 1;
      }
    }
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

MeshRows split(MeshRows rows, const SplitCorners& corners, const Records& copies) {
  const std::size_t vertices = rows.vertices.size();
  for (const SplitCorners::Copy& copy : corners.copies) {
    MeshRows::Point row = rows.vertices[copy.original];
    row.id = copy.id;
    row.mass *= copy.fraction;
    rows.vertices.push_back(row);
  }
  for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
    rows.vertices[vertex].mass *= corners.fraction[vertex];
  }
  rows.vertex_data.append(copies);
  rows.cell_corners = corners.cell_corners;
  return rows;
}

}  // namespace pellicle::surface
