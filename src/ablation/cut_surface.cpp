#include "ablation/cut_surface.h"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "geometry/marching_triangle.h"

namespace pellicle {

namespace {

/// Draws cells and numbers the points.
class Cutter {
 public:
  Cutter(const Sheet& sheet, const Living& living, const std::vector<double>& level)
      : sheet_(sheet), living_(living), level_(level), number_(level.size(), -1) {}

  DrawnSurface draw();

 private:
  /// The points of a living triangle as particles, a virtual centre as the lattice particle.
  std::array<PetscInt, 3> triangle(std::size_t cell, std::size_t k) const {
    return {sheet_.cells[cell][k], sheet_.cells[cell][(k + 1) % 4], sheet_.lattice[cell]};
  }
  PetscInt id(PetscInt particle) const { return sheet_.persistent_id[static_cast<std::size_t>(particle)]; }
  double level(PetscInt particle) const { return level_[static_cast<std::size_t>(particle)]; }
  bool is_alive(std::size_t cell, std::size_t k) const { return living_.triangles[4 * cell + k]; }

  /// Number of the point between two particles, or of one that is uncut if they are the same; -1 where there is none.
  PetscInt& number_of(PetscInt from, PetscInt to) {
    return from == to ? number_[static_cast<std::size_t>(from)]
                      : cut_number_.try_emplace(cut_id(from, to), -1).first->second;
  }
  std::int64_t cut_id(PetscInt from, PetscInt to) const {
    const auto [low, high] = std::minmax({id(from), id(to)});  // by value
    return -(std::int64_t{low} * sheet_.id_end + high) - 1;
  }
  void add_uncut_points();
  /// The point at the share t of the way from one particle of a cell to another. @returns its number
  PetscInt add_point(std::size_t cell, PetscInt from, PetscInt to, double t);
  void draw(std::size_t cell, std::size_t k);

  const Sheet& sheet_;
  const Living& living_;
  const std::vector<double>& level_;
  DrawnSurface surface_;
  std::vector<PetscInt> number_;                           ///< of the uncut point of each particle, or -1
  std::unordered_map<std::int64_t, PetscInt> cut_number_;  ///< of each cut point by id, or -1
  std::vector<PetscInt> least_cell_;                       ///< of each point: least id of the cells drawn at it
};

void Cutter::add_uncut_points() {
  for (const bool centres : {false, true}) {
    for (std::size_t cell = 0; cell < static_cast<std::size_t>(sheet_.owned_cells); ++cell) {
      for (std::size_t k = 0; k < 4; ++k) {
        for (const PetscInt particle : triangle(cell, k)) {
          if (is_alive(cell, k) && level(particle) >= 0 && number_of(particle, particle) < 0 &&
              sheet_.is_lattice[static_cast<std::size_t>(particle)] == centres) {
            number_of(particle, particle) = add_point(cell, particle, particle, 0);
          }
        }
      }
    }
  }
}

PetscInt Cutter::add_point(std::size_t cell, PetscInt from, PetscInt to, double t) {
  DrawnPoint point;
  point.id = from == to ? id(from) : cut_id(from, to);
  const PetscInt lattice = sheet_.lattice[cell];
  if (from == lattice || to == lattice) {
    point.lattice = lattice;
    point.centre_share = to == lattice ? (from == lattice ? 1 : t) : 1 - t;
    for (std::size_t k = 0; k < 4; ++k) {
      const PetscInt corner = sheet_.cells[cell][k];
      point.particles[k] = corner;
      point.weights[k] = point.centre_share / 4 + (corner == from || corner == to ? 1 - point.centre_share : 0);
    }
  } else if (id(from) <= id(to)) {  // All ranks add the two in the same order.
    point.particles = {from, to};
    point.weights = {1 - t, t};
  } else {
    point.particles = {to, from};
    point.weights = {t, 1 - t};
  }
  surface_.points.push_back(point);
  least_cell_.push_back(std::numeric_limits<PetscInt>::max());
  return static_cast<PetscInt>(surface_.points.size()) - 1;
}

void Cutter::draw(std::size_t cell, std::size_t k) {
  const bool is_owned = cell < static_cast<std::size_t>(sheet_.owned_cells);
  const PetscInt cell_id = id(sheet_.lattice[cell]);
  const std::array<PetscInt, 3> particles = triangle(cell, k);
  const KeptPart part = marching_triangle({level(particles[0]), level(particles[1]), level(particles[2])});
  for (std::size_t t = 0; t < static_cast<std::size_t>(part.count); ++t) {
    std::array<PetscInt, 3> points;
    for (std::size_t i = 0; i < 3; ++i) {
      const BorderPoint& border = part.triangles[t][i];
      const PetscInt from = particles[static_cast<std::size_t>(border.from)];
      const PetscInt to = particles[static_cast<std::size_t>(border.to)];
      PetscInt& number = number_of(from, to);
      if (number < 0 && is_owned) {
        number = add_point(cell, from, to, border.t);
      }
      if (number >= 0 && cell_id < least_cell_[static_cast<std::size_t>(number)]) {
        least_cell_[static_cast<std::size_t>(number)] = cell_id;
        surface_.points[static_cast<std::size_t>(number)].is_owned = is_owned;
      }
      points[i] = number;
    }
    if (is_owned) {
      surface_.triangles.push_back(points);
      surface_.cells.push_back(static_cast<PetscInt>(cell));
    }
  }
}

DrawnSurface Cutter::draw() {
  add_uncut_points();
  // Other ranks' cells come last and draw nothing, but may take points. All cells at the points of owned cells are
  // local, so that every rank finds the same owner.
  for (std::size_t cell = 0; cell < sheet_.cells.size(); ++cell) {
    for (std::size_t k = 0; k < 4; ++k) {
      if (is_alive(cell, k)) {
        draw(cell, k);
      }
    }
  }
  return std::move(surface_);
}

}  // namespace

DrawnSurface cut_surface(const Sheet& sheet, const Living& living, const std::vector<double>& level) {
  return Cutter(sheet, living, level).draw();
}

}  // namespace pellicle
