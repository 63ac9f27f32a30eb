#include "surface/pieces.h"

#include <algorithm>
#include <limits>
#include <map>
#include <unordered_map>

#include "base/disjoint_sets.h"
#include "parallel/collective.h"

namespace pellicle::surface {

std::vector<PetscInt> least_connected_ids(const Layout& items, DisjointSets& connected,
                                          const std::vector<PetscInt>& ids) {
  // Sets get the least id of their members, members that of their set, ghosts that of their owner, until all agree.
  std::vector<PetscInt> least(ids.size(), std::numeric_limits<PetscInt>::max());  // of the set that an item represents
  const auto of_set = [&](PetscInt item) -> PetscInt& { return least[connected.find(static_cast<std::size_t>(item))]; };
  for (PetscInt i = 0; i < items.local(); ++i) {
    of_set(i) = std::min(of_set(i), ids[i]);
  }
  std::vector<PetscInt> result(ids.size());
  for (bool changed = true; changed;) {
    for (PetscInt i = 0; i < items.owned; ++i) {
      result[i] = of_set(i);
    }
    update_ghosts(items, result);
    changed = false;
    for (PetscInt i = items.owned; i < items.local(); ++i) {
      changed = changed || result[i] < of_set(i);
      of_set(i) = std::min(of_set(i), result[i]);
    }
    changed = on_any_rank(items.comm, changed);
  }
  return result;
}

namespace {

/// For each local particle the least persistent id among the particles that active springs connect with it, or -1.
/// Collective.
std::vector<PetscInt> connected_parts(const Surface& surface, const ActiveSet& active) {
  constexpr PetscInt none = std::numeric_limits<PetscInt>::max();
  DisjointSets sets(surface.particles.local());
  std::vector<PetscInt> ids(surface.particles.local(), none);  // of particles with active springs
  for_each_active_spring(surface, active, [&](const std::array<PetscInt, 2>& ends) {
    sets.unite(static_cast<std::size_t>(ends[0]), static_cast<std::size_t>(ends[1]));
    for (const PetscInt end : ends) {
      ids[end] = surface.persistent_id[end];
    }
  });
  std::vector<PetscInt> parts = least_connected_ids(surface.particles, sets, ids);
  std::replace(parts.begin(), parts.end(), none, PetscInt{-1});
  return parts;
}

/// Number of particles of each part of each piece; parts are identified by their least persistent id.
using PartSizes = std::map<PetscInt, std::map<PetscInt, PetscInt>>;

/// The sizes of the parts over all ranks. Collective.
PartSizes part_sizes(const Surface& surface, const std::vector<PetscInt>& parts, const std::vector<PetscInt>& pieces) {
  std::map<std::array<PetscInt, 2>, PetscInt> own;  // particles by piece and part
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    if (parts[i] >= 0) {
      ++own[{pieces[i], parts[i]}];
    }
  }
  std::vector<std::array<PetscInt, 3>> sent;
  for (const auto& [of, particles] : own) {
    sent.push_back({of[0], of[1], particles});
  }
  PartSizes sizes;
  for (const auto& [piece, part, particles] : of_all_ranks(surface.comm(), sent)) {
    sizes[piece][part] += particles;
  }
  return sizes;
}

}  // namespace

std::size_t Pieces::place_of(PetscInt id) const {
  return static_cast<std::size_t>(std::lower_bound(present.begin(), present.end(), id) - present.begin());
}

Pieces initial_pieces(const Surface& surface) {
  Pieces pieces;
  pieces.of_particle = connected_parts(surface, ActiveSet(surface));
  // The initial pieces are found as parts of one piece, whose id is not used.
  const PartSizes sizes = part_sizes(surface, pieces.of_particle, std::vector<PetscInt>(pieces.of_particle.size(), 0));
  std::unordered_map<PetscInt, PetscInt> id_of_part{{-1, -1}};
  for (const auto& [whole, parts] : sizes) {
    for (const auto& part : parts) {
      id_of_part[part.first] = pieces.next_id;
      pieces.present.push_back(pieces.next_id++);
      pieces.birth_time.push_back(0);
    }
  }
  for (PetscInt& id : pieces.of_particle) {
    id = id_of_part.at(id);
  }
  return pieces;
}

void update_pieces(Pieces& pieces, const Surface& surface, const ActiveSet& active, double time) {
  const std::vector<PetscInt> parts = connected_parts(surface, active);
  std::unordered_map<PetscInt, PetscInt> id_of_part{{-1, -1}};
  std::vector<PetscInt> present;
  std::vector<double> birth_time;
  const PetscInt first_born = pieces.next_id;
  for (const auto& [id, sizes] : part_sizes(surface, parts, pieces.of_particle)) {
    const auto largest =
        std::max_element(sizes.begin(), sizes.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    for (auto part = sizes.begin(); part != sizes.end(); ++part) {
      if (part != largest) {
        id_of_part[part->first] = pieces.next_id++;
      }
    }
    id_of_part[largest->first] = id;
    present.push_back(id);
    birth_time.push_back(pieces.birth_time[pieces.place_of(id)]);
  }
  for (PetscInt id = first_born; id < pieces.next_id; ++id) {
    present.push_back(id);
    birth_time.push_back(time);
  }
  pieces.present = std::move(present);
  pieces.birth_time = std::move(birth_time);
  std::transform(parts.begin(), parts.end(), pieces.of_particle.begin(),
                 [&id_of_part](PetscInt part) { return id_of_part.at(part); });
}

std::vector<double> piece_masses(const Pieces& pieces, const Surface& surface, const Field& mass) {
  std::vector<double> masses(pieces.present.size(), 0);
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    const PetscInt id = pieces.of_particle[i];
    if (id >= 0) {
      masses[pieces.place_of(id)] += mass.data()[i];
    }
  }
  sum_over_ranks(surface.comm(), masses);
  return masses;
}

}  // namespace pellicle::surface
