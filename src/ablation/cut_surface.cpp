#include "ablation/cut_surface.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <unordered_map>
#include <utility>

#include "geometry/marching_triangle.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"
#include "parallel/route.h"

namespace pellicle::ablation {

namespace {

/// Draws the owned elements and numbers the points.
class Cutter {
 public:
  Cutter(const Surface& surface, const ActiveSet& active, const std::vector<double>& level)
      : surface_(surface), active_(active), level_(level), number_(level.size(), -1) {}

  DrawnSurface draw() {
    drawn_.points.reserve(number_.size());
    least_element_.reserve(number_.size());
    drawn_.triangles.reserve(surface_.owned_triangles());
    drawn_.elements.reserve(surface_.owned_triangles());
    add_uncut_points();
    for (PetscInt t = 0; t < surface_.owned_triangles(); ++t) {
      if (active_.triangles[t]) {
        draw(t);
      }
    }
    find_owners();
    return std::move(drawn_);
  }

 private:
  PetscInt id(PetscInt particle) const { return surface_.persistent_id[particle]; }
  double level(PetscInt particle) const { return level_[particle]; }
  bool is_centre(PetscInt particle) const { return surface_.is_lattice[particle]; }

  /// Number of the cut point between two particles, or of the uncut point if they are the same; -1: none.
  PetscInt& number_of(PetscInt from, PetscInt to) {
    return from == to ? number_[from] : cut_number_.try_emplace(cut_id(from, to), -1).first->second;
  }
  std::int64_t cut_id(PetscInt from, PetscInt to) const {
    const auto [low, high] = std::minmax({id(from), id(to)});  // by value
    return -(std::int64_t{low} * cut_id_stride + high) - 1;
  }

  void add_uncut_points() {
    for (const bool centres : {false, true}) {
      for (PetscInt t = 0; t < surface_.owned_triangles(); ++t) {
        for (const PetscInt particle : surface_.triangles[t]) {
          if (active_.triangles[t] && level(particle) >= 0 && number_of(particle, particle) < 0 &&
              is_centre(particle) == centres) {
            number_of(particle, particle) = add_point(surface_.element_of_triangle(t), particle, particle, 0);
          }
        }
      }
    }
  }

  /// The point at the fraction t of the way from one particle of an element to another. @returns its number
  PetscInt add_point(std::size_t element, PetscInt from, PetscInt to, double t) {
    DrawnPoint point;
    point.id = from == to ? id(from) : cut_id(from, to);
    if (is_centre(from) || is_centre(to)) {
      point.lattice = surface_.lattice[element];
      point.centre_share = is_centre(to) ? (is_centre(from) ? 1 : t) : 1 - t;
      for (std::size_t k = 0; k < 4; ++k) {
        const PetscInt corner = surface_.cells[element][k];
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
    drawn_.points.push_back(point);
    least_element_.push_back(std::numeric_limits<PetscInt>::max());
    return static_cast<PetscInt>(drawn_.points.size()) - 1;
  }

  void draw(std::size_t triangle) {
    const std::size_t element = surface_.element_of_triangle(triangle);
    const std::array<PetscInt, 3>& particles = surface_.triangles[triangle];
    const KeptPart part = marching_triangle({level(particles[0]), level(particles[1]), level(particles[2])});
    for (PetscInt t = 0; t < part.count; ++t) {
      std::array<PetscInt, 3> points;
      for (std::size_t i = 0; i < 3; ++i) {
        const BorderPoint& border = part.triangles[t][i];
        const PetscInt from = particles[border.from];
        const PetscInt to = particles[border.to];
        PetscInt& number = number_of(from, to);
        if (number < 0) {
          number = add_point(element, from, to, border.t);
        }
        PetscInt& least = least_element_[number];
        least = std::min(least, surface_.element_id[element]);
        points[i] = number;
      }
      drawn_.triangles.push_back(points);
      drawn_.elements.push_back(static_cast<PetscInt>(element));
    }
  }

  /// Sets which rank counts each point: of those that draw it the one with the element of the least id. Collective.
  void find_owners() {
    MPI_Comm comm = surface_.comm();
    const int ranks = ranks_of(comm);
    // If another rank draws a point, all its particles are ghosts, here or there.
    std::vector<char> is_shared(level_.size(), 1);
    std::fill_n(is_shared.begin(), surface_.particles.owned, 0);
    gather_flags(surface_.particles, is_shared);
    std::vector<std::size_t> numbers;
    std::vector<std::array<std::int64_t, 2>> claims;  // ids of points, and of elements
    std::vector<int> destinations;
    for (std::size_t number = 0; number < drawn_.points.size(); ++number) {
      const DrawnPoint& point = drawn_.points[number];
      bool shared = true;
      for (std::size_t k = 0; k < 4; ++k) {
        shared = shared && (point.weights[k] == 0 || is_shared[point.particles[k]] != 0);
      }
      if (shared) {
        numbers.push_back(number);
        claims.push_back({point.id, least_element_[number]});
        destinations.push_back(static_cast<int>(std::abs(point.id) % ranks));
      }
    }
    // All claims to one point are sent to the same rank.
    const Route route(comm, destinations);
    std::vector<std::array<std::int64_t, 2>> received = route.send(claims);
    std::unordered_map<std::int64_t, std::int64_t> least;
    for (const auto& [id, element] : received) {
      std::int64_t& known = least.try_emplace(id, element).first->second;
      known = std::min(known, element);
    }
    for (auto& [id, element] : received) {
      element = least.at(id);
    }
    const std::vector<std::array<std::int64_t, 2>> answers = route.send_back(received);
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      drawn_.points[numbers[k]].is_owned = answers[k][1] == least_element_[numbers[k]];
    }
  }

  const Surface& surface_;
  const ActiveSet& active_;
  const std::vector<double>& level_;
  DrawnSurface drawn_;
  std::vector<PetscInt> number_;                           ///< of the uncut point of each particle, or -1
  std::unordered_map<std::int64_t, PetscInt> cut_number_;  ///< of each cut point by id, or -1
  std::vector<PetscInt> least_element_;                    ///< of each point: least id of the elements drawn at it
};

}  // namespace

DrawnSurface cut_surface(const Surface& surface, const ActiveSet& active, const std::vector<double>& level) {
  return Cutter(surface, active, level).draw();
}

double largest_drawn(const Surface& surface, const ActiveSet& active, const std::vector<double>& level,
                     const double* values) {
  double largest = 0;
  for (PetscInt t = 0; t < surface.owned_triangles(); ++t) {
    if (!active.triangles[t]) {
      continue;
    }
    const std::array<PetscInt, 3>& particles = surface.triangles[t];
    const auto level_at = [&](std::size_t k) { return level[particles[k]]; };
    const KeptPart part = marching_triangle({level_at(0), level_at(1), level_at(2)});
    for (PetscInt drawn = 0; drawn < part.count; ++drawn) {
      for (const BorderPoint& point : part.triangles[drawn]) {
        const auto value = [&](int corner) { return values[particles[corner]]; };
        largest = std::max(largest, (1 - point.t) * value(point.from) + point.t * value(point.to));
      }
    }
  }
  return max_over_ranks(surface.comm(), largest);
}

DrawnSurface whole_surface(const Surface& surface) {
  return cut_surface(surface, ActiveSet(surface), std::vector<double>(surface.particles.local(), 1.0));
}

}  // namespace pellicle::ablation
