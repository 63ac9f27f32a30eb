#include "contact/crossings.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <map>
#include <tuple>
#include <utility>

#include "base/error.h"
#include "geometry/nearest_points.h"
#include "meshing/overlaps.h"
#include "parallel/collective.h"
#include "surface/drawn_surface.h"

namespace pellicle::contact {

namespace {

struct Drawn {
  int surface;
  std::array<PetscInt, 3> points;  ///< persistent
  Triangle places;                 ///< [m]
  PetscInt element;                ///< number in the file
};

/// The triangles of all ranks, in an order that does not depend on the ranks. Collective.
std::vector<Drawn> all_triangles(const std::vector<PlacedSurface>& surfaces) {
  std::vector<Drawn> own;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const auto& [surface, position, active] = surfaces[s];
    const std::vector<PetscInt>& id = surface.persistent_id;
    const std::size_t each = surface.triangles_per_element;
    for (PetscInt e = 0; e < surface.elements.owned; ++e) {
      const DrawnPlaces places_of(surface, position.data(), e);
      for (std::size_t t = each * e; t < each * (e + 1); ++t) {
        if (active == nullptr || (*active)[t]) {
          const std::array<PetscInt, 3>& corners = surface.triangles[t];
          own.push_back({static_cast<int>(s),
                         {id[corners[0]], id[corners[1]], id[corners[2]]},
                         places_of(corners),
                         surface.element_id[e]});
        }
      }
    }
  }
  std::vector<Drawn> all = of_all_ranks(surfaces.front().surface.comm(), own);
  std::sort(all.begin(), all.end(), [](const Drawn& a, const Drawn& b) {
    return std::tie(a.surface, a.element, a.points) < std::tie(b.surface, b.element, b.points);
  });
  return all;
}

using NumberPair = std::array<int, 2>;

/// Triangles on points.
struct Heap {
  explicit Heap(const std::vector<Drawn>& all) {
    std::map<std::pair<int, PetscInt>, int> numbers;
    for (const Drawn& drawn : all) {
      std::array<int, 3>& triangle = triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [number, is_new] =
            numbers.emplace(std::pair(drawn.surface, drawn.points[k]), static_cast<int>(points.size()));
        if (is_new) {
          points.push_back(drawn.places[k]);
        }
        triangle[k] = number->second;
      }
    }
  }
  Triangle corners(int triangle) const { return corners_of(points, triangles[triangle]); }
  /// The pairs of triangles for which a test holds, ascending. @param reach by which their boxes may be apart [m]
  std::vector<NumberPair> pairs(double reach, const std::function<bool(int, int)>& test) const {
    std::vector<NumberPair> found;
    visit_near_pairs(points, triangles, reach, [&](int one, int other) {
      const auto [a, b] = std::minmax(one, other);
      if (test(a, b)) {
        found.push_back({a, b});
      }
    });
    std::sort(found.begin(), found.end());
    return found;
  }
  std::vector<NumberPair> cuts() const {
    return pairs(0, [this](int a, int b) {
      return !have_common_point(triangles[a], triangles[b]) && triangles_intersect(corners(a), corners(b));
    });
  }

  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> triangles;
};

void note_first(Crossings& crossings, const std::vector<Drawn>& all, const NumberPair& pair) {
  const Drawn& first = all[pair[0]];
  const Drawn& second = all[pair[1]];
  crossings.elements = {first.element, second.element};
  crossings.surfaces = {first.surface, second.surface};
  crossings.place = first.places[0];
}

/// @param find counts the crossings, on rank 0
template <class Find>
Crossings found_on_root(MPI_Comm comm, const Find& find) {
  Crossings crossings;
  on_root(comm, [&] { find(crossings); });
  MPI_Bcast(&crossings, sizeof crossings, MPI_BYTE, 0, comm);
  return crossings;
}

}  // namespace

bool triangles_touch(const Triangle& a, const Triangle& b, double touch) {
  const auto height = [](const Triangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]).norm() / longest_side(t); };
  if (!(height(a) > touch && height(b) > touch)) {
    return false;  // A line is in one place with its own neighbours.
  }
  const auto is_at = [touch](const Eigen::Vector3d& p, const Eigen::Vector3d& q) { return (p - q).norm() <= touch; };
  const auto is_corner_of = [&](const Eigen::Vector3d& p, const Triangle& t) {
    return std::any_of(t.begin(), t.end(), [&](const Eigen::Vector3d& q) { return is_at(p, q); });
  };
  int in_one_place = 0;
  for (const auto& [of, on] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    for (const Eigen::Vector3d& p : *of) {
      if (is_corner_of(p, *on)) {
        ++in_one_place;
      } else if (nearest_of_point_and_triangle({p, (*on)[0], (*on)[1], (*on)[2]}).apart.norm() <= touch) {
        return true;
      }
    }
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const std::array<Eigen::Vector3d, 2> edge{a[k], a[(k + 1) % 3]};
    for (std::size_t l = 0; l < 3; ++l) {
      const std::array<Eigen::Vector3d, 2> other{b[l], b[(l + 1) % 3]};
      const bool have_common_end =
          is_at(edge[0], other[0]) || is_at(edge[0], other[1]) || is_at(edge[1], other[0]) || is_at(edge[1], other[1]);
      if (!have_common_end && nearest_of_edges({edge[0], edge[1], other[0], other[1]}).apart.norm() <= touch) {
        return true;
      }
    }
  }
  return in_one_place == 6;
}

Crossings find_crossings(const std::vector<PlacedSurface>& surfaces, double touch) {
  const std::vector<Drawn> all = all_triangles(surfaces);
  return found_on_root(surfaces.front().surface.comm(), [&](Crossings& crossings) {
    const Heap heap(all);
    const SelfIntersections cuts = count_self_intersections(heap.points, heap.triangles);
    crossings.pairs = cuts.pairs;
    std::vector<NumberPair> touching;
    if (touch > 0) {
      touching = heap.pairs(touch, [&](int a, int b) {
        const Triangle first = heap.corners(a);
        const Triangle second = heap.corners(b);
        return triangles_touch(first, second, touch) &&
               (have_common_point(heap.triangles[a], heap.triangles[b]) || !triangles_intersect(first, second));
      });
      crossings.touching = static_cast<int>(touching.size());
    }
    if (cuts.pairs > 0 && (touching.empty() || cuts.first < touching.front())) {
      note_first(crossings, all, cuts.first);
    } else if (!touching.empty()) {
      note_first(crossings, all, touching.front());
    }
  });
}

Crossings find_new_crossings(const std::vector<PlacedSurface>& before, const std::vector<PlacedSurface>& surfaces) {
  const std::vector<Drawn> all_before = all_triangles(before);
  const std::vector<Drawn> all = all_triangles(surfaces);
  return found_on_root(surfaces.front().surface.comm(), [&](Crossings& crossings) {
    const std::vector<NumberPair> old = Heap(all_before).cuts();
    const std::vector<NumberPair> now = Heap(all).cuts();
    std::vector<NumberPair> added;
    std::set_difference(now.begin(), now.end(), old.begin(), old.end(), std::back_inserter(added));
    crossings.pairs = static_cast<int>(added.size());
    if (!added.empty()) {
      note_first(crossings, all, added.front());
    }
  });
}

std::string crossing_words(const Crossings& crossings, const std::vector<std::string>& names) {
  const auto element = [&](std::size_t k) {
    const std::string& object = names[crossings.surfaces[k]];
    return (object.empty() ? "" : object + "'s ") + std::to_string(crossings.elements[k]);
  };
  std::string words;
  if (crossings.pairs > 0) {
    words = std::to_string(crossings.pairs) + " pairs of triangles pass through each other";
  }
  if (crossings.touching > 0) {
    words += words.empty() ? std::to_string(crossings.touching) + " pairs of triangles touch"
                           : " and " + std::to_string(crossings.touching) + " touch";
  }
  return words + fmt::format(", first of elements {} and {} at ({:.4g}, {:.4g}, {:.4g}) m", element(0), element(1),
                             crossings.place[0], crossings.place[1], crossings.place[2]);
}

}  // namespace pellicle::contact
