#include "meshing/surface_mesh.h"

#include <petscsys.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/memory.h"
#include "base/sorting.h"
#include "base/units.h"
#include "meshing/box_pairs.h"

namespace pellicle::meshing {

void require_mesh_size(const std::string& what, double faces) {
  // A quad brings a vertex, ten springs and four triangles, which are numbered over all ranks.
  constexpr double most_faces = PETSC_MAX_INT / 16;
  refuse_if(!(faces <= most_faces), "{}: {:g} faces, expected at most {:g}", what, faces, most_faces);
  // Until the mesh is distributed each face takes at least so many bytes (measured: a triangle 630, a quad 1500). A run
  // takes several times as much, spread over the ranks.
  constexpr double bytes_of_a_face = 600;
  require_memory(what, bytes_of_a_face * faces);
}

std::vector<std::vector<Eigen::Vector2d>> uv_of_corners(const SurfaceMesh& mesh,
                                                        const std::vector<Eigen::Vector2d>& uv_of_points) {
  std::vector<std::vector<Eigen::Vector2d>> uv;
  for (const std::vector<int>& face : mesh.faces) {
    std::vector<Eigen::Vector2d>& corners = uv.emplace_back();
    corners.reserve(face.size());
    for (const int point : face) {
      if (point >= 0 && static_cast<std::size_t>(point) < uv_of_points.size()) {
        corners.push_back(uv_of_points[point]);
      }
    }
  }
  return uv;
}

namespace {

/// Renumbers the members of groups: `i` becomes `target[i]`, or is removed if that is negative. They stay ascending.
void renumber(std::map<std::string, std::vector<int>>& groups, const std::vector<int>& target) {
  for (auto& entry : groups) {
    std::vector<int> members;
    for (const int member : entry.second) {
      if (target[member] >= 0) {
        members.push_back(target[member]);
      }
    }
    entry.second = without_repeats(std::move(members));
  }
}

/// A choice among items of a mesh, such as its points: an item is kept if it represents itself.
struct Kept {
  /// @param representatives of each, itself or one before it; -1: none
  explicit Kept(const std::vector<int>& representatives) : stands(representatives) {
    for (const int standing : stands) {
      const bool is_kept = standing == static_cast<int>(target.size());
      target.push_back(is_kept ? count++ : standing < 0 ? -1 : target[standing]);
    }
  }
  template <class Items>
  void keep(Items& items) const {
    Items all = std::exchange(items, {});
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (stands[i] == static_cast<int>(i)) {
        items.push_back(std::move(all[i]));
      }
    }
  }
  int removed() const { return static_cast<int>(stands.size()) - count; }

  const std::vector<int>& stands;
  std::vector<int> target;  ///< new number of each, or of its representative; -1: none
  int count = 0;
};

/// The points at the same place, exactly.
DisjointSets equal_points(const std::vector<Eigen::Vector3d>& points) {
  std::vector<int> order = numbers_up_to(points.size());
  const auto at = [&points](int i) -> const Eigen::Vector3d& { return points[i]; };
  std::sort(order.begin(), order.end(), [&at](int a, int b) {
    return std::tie(at(a).x(), at(a).y(), at(a).z(), a) < std::tie(at(b).x(), at(b).y(), at(b).z(), b);
  });
  DisjointSets sets(points.size());
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (at(order[k]) == at(order[k - 1])) {
      sets.unite(order[k], order[k - 1]);
    }
  }
  return sets;
}

/// Unites the points of different sets that are near each other. @returns whether all of these were found
bool unite_near_points(DisjointSets& sets, const std::vector<Eigen::Vector3d>& points, double distance) {
  std::vector<std::size_t> lowest;  // of each set
  std::vector<Box> boxes;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(distance / 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (sets.find(i) == i) {
      lowest.push_back(i);
      boxes.emplace_back(points[i] - half, points[i] + half);
    }
  }
  return visit_pairs(boxes, boxes, [&](int first, int second) {
    const std::size_t a = lowest[first];
    const std::size_t b = lowest[second];
    if ((points[a] - points[b]).norm() <= distance) {
      sets.unite(a, b);
    }
    return 1;
  });
}

}  // namespace

int keep_points(SurfaceMesh& mesh, const std::vector<int>& stands) {
  const Kept kept(stands);
  if (kept.removed() == 0 || kept.count == 0) {
    return kept.removed();
  }
  if (mesh.point_id.empty()) {
    mesh.point_id = numbers_up_to(mesh.points.size());
  }
  kept.keep(mesh.point_id);
  kept.keep(mesh.points);
  for (std::vector<int>& face : mesh.faces) {
    for (int& point : face) {
      point = kept.target[point];
    }
  }
  renumber(mesh.groups, kept.target);
  return kept.removed();
}

int keep_faces(SurfaceMesh& mesh, const std::vector<int>& stands) {
  const Kept kept(stands);
  if (kept.removed() == 0) {
    return 0;
  }
  if (mesh.face_id.empty()) {
    mesh.face_id = numbers_up_to(mesh.faces.size());
  }
  kept.keep(mesh.face_id);
  kept.keep(mesh.faces);
  kept.keep(mesh.uv);
  for (auto& entry : mesh.face_fields) {
    kept.keep(entry.second);
  }
  renumber(mesh.face_groups, kept.target);
  return kept.removed();
}

int weld(SurfaceMesh& mesh, double distance) {
  DisjointSets sets = equal_points(mesh.points);
  refuse_if(distance > 0 && !unite_near_points(sets, mesh.points, distance),
            "mesh.merge_distance: very many points lie within {} m of each other, expected a shorter distance",
            number_text(distance));
  std::vector<int> stands;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    stands.push_back(static_cast<int>(sets.find(i)));
  }
  return keep_points(mesh, stands);
}

}  // namespace pellicle::meshing
