#include "ablation/ablation.h"

#include <algorithm>

#include "parallel/collective.h"

namespace pellicle {

namespace {

/// A flag for each triangle of a cell, kept at the cell's lattice particle.
using TriangleFlags = std::array<bool, 4>;

}  // namespace

std::vector<double> level_set(const Sheet& sheet, const Field& mass, double loss_mass) {
  std::vector<double> level(static_cast<std::size_t>(sheet.particles.local()));
  for (std::size_t i = 0; i < level.size(); ++i) {
    level[i] = mass.data()[i] / sheet.initial_mass[i] - loss_mass;
  }
  return level;
}

SpringState spring_state(double level_0, double level_1) {
  if (level_0 >= 0 && level_1 >= 0) {
    return SpringState::shrunk;
  }
  return level_0 < 0 && level_1 < 0 ? SpringState::burnt : SpringState::partly_burnt;
}

bool Ablation::burn_away(Living& living, const std::vector<double>& level) {
  const auto has_burnt = [&level](PetscInt particle) { return level[static_cast<std::size_t>(particle)] < 0; };
  bool died = false;
  for (std::size_t c = 0; c < static_cast<std::size_t>(sheet_.owned_cells); ++c) {
    if (!has_burnt(sheet_.lattice[c])) {
      continue;
    }
    const std::array<PetscInt, 4>& corners = sheet_.cells[c];
    for (std::size_t k = 0; k < 4; ++k) {
      if (living.triangles[4 * c + k] && has_burnt(corners[k]) && has_burnt(corners[(k + 1) % 4])) {
        living.triangles[4 * c + k] = false;
        died = true;
      }
    }
  }
  return spread(living, died);
}

bool Ablation::tear(Living& living, const std::array<std::vector<PetscInt>, 4>& torn) {
  const bool tears = std::any_of(torn.begin(), torn.end(), [](const auto& springs) { return !springs.empty(); });
  if (!on_any_rank(sheet_.comm(), tears)) {
    return false;
  }
  // A torn spring of this rank may have triangles in cells of others, which their owners mark.
  std::vector<TriangleFlags> marks(static_cast<std::size_t>(sheet_.particles.local()), TriangleFlags{});
  for (const Colour colour : all_colours) {
    for (const PetscInt spring : torn[static_cast<std::size_t>(colour)]) {
      for (const PetscInt triangle : sheet_.of(colour).triangles[static_cast<std::size_t>(spring)]) {
        if (triangle >= 0) {
          const PetscInt lattice = sheet_.lattice[static_cast<std::size_t>(triangle / 4)];
          marks[static_cast<std::size_t>(lattice)][static_cast<std::size_t>(triangle % 4)] = true;
        }
      }
    }
  }
  gather_flags(sheet_.particles, marks);
  bool died = false;
  for (std::size_t t = 0; t < 4 * static_cast<std::size_t>(sheet_.owned_cells); ++t) {
    if (living.triangles[t] && marks[static_cast<std::size_t>(sheet_.lattice[t / 4])][t % 4]) {
      living.triangles[t] = false;
      died = true;
    }
  }
  return spread(living, died);
}

bool Ablation::spread(Living& living, bool died) {
  if (!on_any_rank(sheet_.comm(), died)) {
    return false;
  }
  std::vector<TriangleFlags> lives(static_cast<std::size_t>(sheet_.particles.local()), TriangleFlags{});
  const std::size_t owned_triangles = 4 * static_cast<std::size_t>(sheet_.owned_cells);
  for (std::size_t t = 0; t < owned_triangles; ++t) {
    lives[static_cast<std::size_t>(sheet_.lattice[t / 4])][t % 4] = living.triangles[t];
  }
  update_ghosts(sheet_.particles, lives);
  for (std::size_t t = owned_triangles; t < living.triangles.size(); ++t) {
    living.triangles[t] = lives[static_cast<std::size_t>(sheet_.lattice[t / 4])][t % 4];
  }

  // All triangles of an owned spring are local; a ghost's need not be.
  const auto is_alive = [&living](PetscInt t) { return t >= 0 && living.triangles[static_cast<std::size_t>(t)]; };
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet_.of(colour);
    std::vector<bool>& springs = living.springs[static_cast<std::size_t>(colour)];
    for (std::size_t s = 0; s < static_cast<std::size_t>(set.owned()); ++s) {
      springs[s] = springs[s] && std::any_of(set.triangles[s].begin(), set.triangles[s].end(), is_alive);
    }
    update_ghosts(set.layout, springs);
  }
  return true;
}

std::vector<PetscInt> Ablation::bare_particles(const Living& living, const Field& mass) const {
  const std::vector<bool> has_springs = particles_with_springs(sheet_, living);
  std::vector<PetscInt> bare;
  for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
    if (!has_springs[static_cast<std::size_t>(i)] && mass.data()[i] > 0) {
      bare.push_back(i);
    }
  }
  return bare;
}

std::vector<bool> empty_cells(const Sheet& sheet, const Living& living) {
  // Red and green springs end at the lattice point; the yellow ones of a cell live exactly as long as a red one does.
  const std::vector<bool> has_springs = particles_with_springs(sheet, living);
  std::vector<bool> empty;
  for (PetscInt c = 0; c < sheet.owned_cells; ++c) {
    empty.push_back(!has_springs[static_cast<std::size_t>(sheet.lattice[static_cast<std::size_t>(c)])]);
  }
  return empty;
}

}  // namespace pellicle
