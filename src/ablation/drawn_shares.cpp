#include "ablation/drawn_shares.h"

#include <algorithm>
#include <array>

#include "geometry/pressure_load.h"

namespace pellicle::ablation {

namespace {

/// Least drawn fraction of an active cell: smaller ones are raised to it, so that all amounts are passed on.
constexpr double least_share = 1e-9;

/// Corners and lattice particle of a cell.
std::array<PetscInt, 5> particles_of(const Sheet& sheet, std::size_t cell) {
  const std::array<PetscInt, 4>& corners = sheet.cells[cell];
  return {corners[0], corners[1], corners[2], corners[3], sheet.lattice[cell]};
}

/// Area of the four triangles of a cell.
double whole_area(const std::array<PetscInt, 4>& corners, const Field& positions) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const PetscInt corner : corners) {
    centre += positions.vector(corner) / 4;
  }
  double area = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    area += area_vector(positions.vector(corners[k]), positions.vector(corners[(k + 1) % 4]), centre).norm();
  }
  return area;
}

}  // namespace

DrawnShares::DrawnShares(const Sheet& sheet, const ActiveSet& active, const DrawnSurface& surface,
                         const Field& positions)
    : sheet_(sheet),
      area_(sheet.elements.owned, 0.0),
      cell_weight_(sheet.particles, 1),
      weight_(sheet.particles, 1),
      drawn_(sheet.particles, 1),
      given_(sheet.particles, 1) {
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto corner = [&](std::size_t k) { return at_point(surface.points[surface.triangles[t][k]], positions); };
    area_[surface.elements[t]] += area_vector(corner(0), corner(1), corner(2)).norm();
  }
  for (std::size_t cell = 0; cell < area_.size(); ++cell) {
    const auto first = active.triangles.begin() + 4 * static_cast<std::ptrdiff_t>(cell);
    if (std::none_of(first, first + 4, [](bool lives) { return lives; })) {
      continue;
    }
    const PetscInt lattice = sheet.lattice[cell];
    const double fraction = area_[cell] > 0 ? std::min(1.0, area_[cell] / whole_area(sheet.cells[cell], positions)) : 0;
    cell_weight_.data()[lattice] = std::max(fraction, least_share) * 2 * sheet.initial_mass[lattice];
    for (const PetscInt i : particles_of(sheet, cell)) {
      weight_.data()[i] += area_[cell] > 0 ? cell_weight_.data()[lattice] : 0;
      giving_.push_back({i, cell});
    }
  }
  cell_weight_.update_ghosts();
  weight_.add_ghosts();
  weight_.update_ghosts();
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    // A lattice particle has half of its cell's initial mass, a corner an eighth of that of each cell at it.
    drawn_.data()[i] = std::min(1.0, weight_.data()[i] / ((sheet.is_lattice[i] ? 2 : 8) * sheet.initial_mass[i]));
  }
  find_held(active);

  for (const auto& [particle, cell] : giving_) {
    double drawn = 0;  // of those that take it
    for (const PetscInt i : particles_of(sheet, cell)) {
      drawn += drawn_.data()[i];
    }
    given_.data()[particle] += cell_weight_.data()[sheet.lattice[cell]] * drawn;
  }
  given_.add_ghosts();
  given_.update_ghosts();
}

void DrawnShares::find_held(const ActiveSet& active) {
  for (const Colour colour : {Colour::green, Colour::yellow}) {  // The others lie in a triangle that holds them.
    const SpringSet& springs = sheet_.of(colour);
    for (PetscInt s = 0; s < springs.owned(); ++s) {
      if (!active.springs[colour][s]) {
        continue;
      }
      for (const PetscInt end : springs.ends[s]) {
        PetscInt last = -1;  // All triangles of a yellow spring are of one cell.
        for (const PetscInt triangle : springs.triangles[s]) {
          if (weight_.data()[end] == 0 && triangle >= 0 && active.triangles[triangle] && triangle / 4 != last) {
            last = triangle / 4;
            giving_.push_back({end, static_cast<std::size_t>(last)});
          }
        }
      }
    }
  }
}

std::vector<double> DrawnShares::density(const Field& amount) const {
  // Amount that each cell passes on from undrawn or partly drawn particles, per fraction of the receivers.
  Field passed(sheet_.particles, 1);
  for (const auto& [particle, cell] : giving_) {
    const PetscInt lattice = sheet_.lattice[cell];
    if (given_.data()[particle] > 0) {
      passed.data()[lattice] += (1 - drawn_.data()[particle]) * amount.data()[particle] * cell_weight_.data()[lattice] /
                                given_.data()[particle];
    }
  }
  passed.add_ghosts();

  Field taken(sheet_.particles, 1);
  for (std::size_t cell = 0; cell < area_.size(); ++cell) {
    for (const PetscInt i : particles_of(sheet_, cell)) {
      taken.data()[i] += drawn_.data()[i] * passed.data()[sheet_.lattice[cell]];
    }
  }
  taken.add_ghosts();
  taken.update_ghosts();

  std::vector<double> density(sheet_.cells.size(), 0.0);
  for (std::size_t cell = 0; cell < area_.size(); ++cell) {
    if (area_[cell] > 0) {
      for (const PetscInt i : particles_of(sheet_, cell)) {
        density[cell] += (drawn_.data()[i] * amount.data()[i] + taken.data()[i]) *
                         cell_weight_.data()[sheet_.lattice[cell]] / weight_.data()[i];
      }
      density[cell] /= area_[cell];
    }
  }
  return density;
}

}  // namespace pellicle::ablation
