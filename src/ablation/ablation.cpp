#include "ablation/ablation.h"

#include <algorithm>
#include <array>

#include "parallel/collective.h"
#include "parallel/exchange.h"

namespace pellicle::ablation {

std::vector<double> level_set(const Surface& surface, const Field& mass, double loss_mass, std::vector<double> level) {
  level.resize(surface.particles.local());
  for (std::size_t i = 0; i < level.size(); ++i) {
    level[i] = mass.data()[i] / surface.initial_mass[i] - loss_mass;
  }
  return level;
}

SpringState spring_state(double level_0, double level_1) {
  if (level_0 >= 0 && level_1 >= 0) {
    return SpringState::shrunk;
  }
  return level_0 < 0 && level_1 < 0 ? SpringState::burnt : SpringState::partly_burnt;
}

bool burn_away(const Surface& surface, SpringRule rule, ActiveSet& active, const std::vector<double>& level) {
  const auto has_burnt = [&level](PetscInt particle) { return level[particle] < 0; };
  bool died = false;
  for (PetscInt t = 0; t < surface.owned_triangles(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    if (active.triangles[t] && has_burnt(a) && has_burnt(b) && has_burnt(c)) {
      active.triangles[t] = false;
      died = true;
    }
  }
  died = on_any_rank(surface.comm(), died);
  if (died) {
    follow_triangles(surface, rule, active);
  }
  return died;
}

bool crack(const Surface& surface, SpringRule rule, ActiveSet& active, const std::vector<PetscInt>& sides) {
  if (!on_any_rank(surface.comm(), !sides.empty())) {
    return false;
  }
  // A side of this rank's springs may belong to another rank's cell, which that rank marks.
  std::vector<std::array<bool, 4>> marks(surface.elements.local());
  const std::size_t per_element = surface.sides_per_element();
  for (const PetscInt blue : sides) {
    for (const PetscInt of_element : surface.sides_along(blue)) {
      const std::size_t side = of_element;
      marks[side / per_element][side % per_element] = true;
    }
  }
  gather_flags(surface.elements, marks);
  for (std::size_t side = 0; side < per_element * static_cast<std::size_t>(surface.elements.owned); ++side) {
    active.cracked[side] = active.cracked[side] || marks[side / per_element][side % per_element];
  }
  follow_triangles(surface, rule, active);
  return true;
}

void follow_triangles(const Surface& surface, SpringRule rule, ActiveSet& active) {
  update_ghosts(surface.elements, active.triangles, static_cast<std::size_t>(surface.triangles_per_element));
  update_ghosts(surface.elements, active.cracked, static_cast<std::size_t>(surface.sides_per_element()));
  const bool by_surface = rule == SpringRule::surface;
  const std::vector<bool> has_surface = by_surface ? particles_with_surface(surface, active) : std::vector<bool>();
  const auto is_held = [&](PetscInt particle) { return !by_surface || has_surface[particle]; };
  // All triangles of an owned spring are local; a ghost's need not be.
  const auto is_alive = [&active](PetscInt t) { return t >= 0 && active.triangles[t]; };
  for (const Colour colour : all_colours) {
    const SpringSet& set = surface.of(colour);
    std::vector<bool>& springs = active.springs[colour];
    for (PetscInt s = 0; s < set.owned(); ++s) {
      // A green spring crosses the side of a quad's surface triangle, which has its number.
      const bool crosses_crack = colour == Colour::green && active.cracked[set.triangles[s].front()];
      const auto [a, b] = set.ends[s];
      springs[s] = springs[s] && !crosses_crack && is_held(a) && is_held(b) &&
                   std::any_of(set.triangles[s].begin(), set.triangles[s].end(), is_alive);
    }
    update_ghosts(set.layout, springs);
  }
}

std::vector<bool> particles_with_surface(const Surface& surface, const ActiveSet& active) {
  std::vector<char> flags(surface.particles.local(), 0);
  for (PetscInt t = 0; t < surface.owned_triangles(); ++t) {
    if (active.triangles[t]) {
      for (const PetscInt particle : surface.triangles[t]) {
        flags[particle] = 1;
      }
    }
  }
  gather_flags(surface.particles, flags);
  update_ghosts(surface.particles, flags);
  return {flags.begin(), flags.end()};
}

std::vector<PetscInt> bare_particles(const Surface& surface, const ActiveSet& active, const Field& mass) {
  const std::vector<bool> has_springs = particles_with_springs(surface, active);
  std::vector<PetscInt> bare;
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    if (!has_springs[i] && mass.data()[i] > 0) {
      bare.push_back(i);
    }
  }
  return bare;
}

std::vector<bool> empty_cells(const Sheet& sheet, const ActiveSet& active) {
  // Red and green springs end at the lattice point; the yellow ones of a cell live exactly as long as a red one does.
  const std::vector<bool> has_springs = particles_with_springs(sheet, active);
  std::vector<bool> empty;
  for (PetscInt c = 0; c < sheet.elements.owned; ++c) {
    empty.push_back(!has_springs[sheet.lattice[c]]);
  }
  return empty;
}

}  // namespace pellicle::ablation
