#include "surface/pieces.h"

#include <algorithm>
#include <limits>
#include <map>
#include <unordered_map>

#include "base/disjoint_sets.h"
#include "parallel/collective.h"

namespace pellicle {
inline namespace surface {

namespace {

/// For each local particle the least persistent id among the particles that active springs connect with it, or -1.
/// Collective.
std::vector<PetscInt> connected_parts(const Surface& surface, const ActiveSet& active) {
  DisjointSets sets(surface.particles.local());
  for (const Colour colour : all_colours) {
    const std::vector<std::array<PetscInt, 2>>& ends = surface.of(colour).ends;
    const std::vector<bool>& lives = active.springs[static_cast<std::size_t>(colour)];
    for (std::size_t s = 0; s < ends.size(); ++s) {
      if (lives[s]) {
        sets.unite(static_cast<std::size_t>(ends[s][0]), static_cast<std::size_t>(ends[s][1]));
      }
    }
  }

  // Sets get the least id of their members, members that of their set, ghosts that of their owner, until all agree.
  const std::vector<bool> has_springs = particles_with_springs(surface, active);
  const PetscInt owned = surface.particles.owned;
  const PetscInt local = surface.particles.local();
  std::vector<PetscInt> least(has_springs.size(), std::numeric_limits<PetscInt>::max());
  std::vector<std::size_t> set_of(has_springs.size());
  for (PetscInt i = 0; i < local; ++i) {
    const std::size_t k = i;
    set_of[k] = sets.find(k);
    least[set_of[k]] = std::min(least[set_of[k]], surface.persistent_id[k]);
  }
  std::vector<PetscInt> part(has_springs.size());
  for (bool changed = true; changed;) {
    for (PetscInt i = 0; i < owned; ++i) {
      part[i] = has_springs[i] ? least[set_of[i]] : -1;
    }
    update_ghosts(surface.particles, part);
    changed = false;
    for (PetscInt i = owned; i < local; ++i) {
      PetscInt& of_set = least[set_of[i]];
      const PetscInt of_ghost = part[i];
      if (of_ghost >= 0 && of_ghost < of_set) {
        changed = true;
        of_set = of_ghost;
      }
    }
    changed = on_any_rank(surface.comm(), changed);
  }
  return part;
}

/// Number of particles of each part of each piece; parts are identified by their least persistent id.
using PartSizes = std::map<PetscInt, std::map<PetscInt, PetscInt>>;

/// The sizes of the parts over all ranks. Collective.
PartSizes part_sizes(const Surface& surface, const std::vector<PetscInt>& parts, const std::vector<PetscInt>& pieces) {
  std::unordered_map<PetscInt, std::array<PetscInt, 3>> own;  // by part: piece, part, particles
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    if (parts[i] >= 0) {
      ++own.insert({parts[i], {pieces[i], parts[i], 0}}).first->second[2];
    }
  }
  std::vector<PetscInt> sent;
  for (const auto& entry : own) {
    sent.insert(sent.end(), entry.second.begin(), entry.second.end());
  }
  const std::vector<PetscInt> received = of_all_ranks(surface.comm(), sent);
  PartSizes sizes;
  for (std::size_t k = 0; k < received.size(); k += 3) {
    sizes[received[k]][received[k + 1]] += received[k + 2];
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

}  // namespace surface
}  // namespace pellicle
