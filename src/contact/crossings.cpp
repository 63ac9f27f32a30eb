#include "contact/crossings.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <tuple>
#include <utility>

#include "meshing/self_intersection.h"
#include "parallel/collective.h"
#include "surface/drawn_places.h"

namespace pellicle {
inline namespace contact {

namespace {

struct Drawn {
  std::int32_t surface;
  std::array<std::int64_t, 3> points;  ///< persistent
  std::array<double, 9> places;        ///< [m]
  std::int64_t element;                ///< number in the file
};

}  // namespace

Crossings find_crossings(const std::vector<PlacedSurface>& surfaces) {
  const MPI_Comm comm = surfaces.front().surface.comm();
  std::vector<Drawn> own;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const auto& [surface, position, living] = surfaces[s];
    const auto each = static_cast<std::size_t>(surface.triangles_per_element);
    for (std::size_t e = 0; e < static_cast<std::size_t>(surface.elements.owned); ++e) {
      const DrawnPlaces places_of(surface, position.data(), e);
      for (std::size_t t = each * e; t < each * (e + 1); ++t) {
        if (living != nullptr && !(*living)[t]) {
          continue;
        }
        Drawn drawn{};
        drawn.surface = static_cast<std::int32_t>(s);
        drawn.element = surface.element_id[e];
        const std::array<Eigen::Vector3d, 3> places = places_of(surface.triangles[t]);
        for (std::size_t k = 0; k < 3; ++k) {
          drawn.points[k] = surface.persistent_id[static_cast<std::size_t>(surface.triangles[t][k])];
          std::copy_n(places[k].data(), 3, drawn.places.begin() + static_cast<std::ptrdiff_t>(3 * k));
        }
        own.push_back(drawn);
      }
    }
  }
  std::vector<Drawn> all = of_all_ranks(comm, own);
  std::sort(all.begin(), all.end(), [](const Drawn& a, const Drawn& b) {
    return std::tie(a.surface, a.element, a.points) < std::tie(b.surface, b.element, b.points);
  });
  Crossings crossings;
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  if (rank == 0) {
    std::vector<Eigen::Vector3d> points;
    std::vector<std::array<int, 3>> triangles;
    std::map<std::pair<std::int32_t, std::int64_t>, int> numbers;
    for (const Drawn& drawn : all) {
      std::array<int, 3>& triangle = triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [number, is_new] =
            numbers.emplace(std::pair(drawn.surface, drawn.points[k]), static_cast<int>(points.size()));
        if (is_new) {
          points.emplace_back(drawn.places.data() + 3 * k);
        }
        triangle[k] = number->second;
      }
    }
    const SelfIntersections found = count_self_intersections(points, triangles);
    crossings.pairs = found.pairs;
    if (found.pairs > 0) {
      const Drawn& first = all[static_cast<std::size_t>(found.first[0])];
      const Drawn& second = all[static_cast<std::size_t>(found.first[1])];
      crossings.elements = {static_cast<PetscInt>(first.element), static_cast<PetscInt>(second.element)};
      crossings.surfaces = {first.surface, second.surface};
      crossings.place = Eigen::Vector3d(first.places.data());
    }
  }
  MPI_Bcast(&crossings, sizeof crossings, MPI_BYTE, 0, comm);
  return crossings;
}

}  // namespace contact
}  // namespace pellicle
