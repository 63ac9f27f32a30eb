#include "meshing/closed_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/error.h"
#include "geometry/pi.h"
#include "geometry/solid_distance.h"
#include "meshing/implicit_surface.h"

namespace pellicle::meshing {

namespace {

void require_above_0(double value, const char* what) {
  refuse_if(!(value > 0), "{} of {:f} m, expected above 0", what, value);
}

/// Longitude of each corner as u, `height` of its point as v.
template <class Height>
void wrap_uv(SurfaceMesh& mesh, const Height& height) {
  for (const std::vector<int>& face : mesh.faces) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const int number : face) {
      centre += mesh.points[number];
    }
    const double middle = std::atan2(centre.y(), centre.x());
    std::vector<Eigen::Vector2d>& corners = mesh.uv.emplace_back();
    for (const int number : face) {
      // Seen from the middle of the face, so that a face at the seam stays on its side; a pole gets the u of the face.
      const Eigen::Vector3d& point = mesh.points[number];
      const bool pole = std::hypot(point.x(), point.y()) < 1e-9 * point.norm();
      const double turn = pole ? 0 : std::remainder(std::atan2(point.y(), point.x()) - middle, 2 * pi);
      corners.emplace_back(std::clamp(0.5 + (middle + turn) / (2 * pi), 0.0, 1.0), height(point));
    }
  }
}

/// Points of length 1.
SurfaceMesh icosahedron() {
  // Two poles, and two rings of five between them at z = +- 1/sqrt(5), turned against each other.
  SurfaceMesh mesh;
  const double z = 1 / std::sqrt(5.0);
  mesh.points.emplace_back(0, 0, 1);
  for (int k = 0; k < 10; ++k) {
    const double angle = k * pi / 5;
    mesh.points.emplace_back(2 * z * std::cos(angle), 2 * z * std::sin(angle), k % 2 == 0 ? z : -z);
  }
  mesh.points.emplace_back(0, 0, -1);
  const auto ring = [](int k) { return 1 + k % 10; };
  for (int k = 0; k < 10; k += 2) {
    mesh.faces.push_back({0, ring(k), ring(k + 2)});
    mesh.faces.push_back({ring(k), ring(k + 1), ring(k + 2)});
    mesh.faces.push_back({ring(k + 1), ring(k + 3), ring(k + 2)});
    mesh.faces.push_back({11, ring(k + 3), ring(k + 1)});
  }
  return mesh;
}

SurfaceMesh unit_icosphere(int level) {
  refuse_if(level < 0 || level > 9, "an icosphere of level {}, expected 0 to 9", level);
  SurfaceMesh mesh = icosahedron();
  for (int l = 0; l < level; ++l) {
    std::map<std::array<int, 2>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [entry, is_new] =
          middles.emplace(std::array{std::min(a, b), std::max(a, b)}, static_cast<int>(mesh.points.size()));
      if (is_new) {
        mesh.points.push_back((mesh.points[a] + mesh.points[b]).normalized());
      }
      return entry->second;
    };
    std::vector<std::vector<int>> faces;
    for (const std::vector<int>& face : mesh.faces) {
      const int ab = middle(face[0], face[1]);
      const int bc = middle(face[1], face[2]);
      const int ca = middle(face[2], face[0]);
      faces.insert(faces.end(), {{face[0], ab, ca}, {face[1], bc, ab}, {face[2], ca, bc}, {ab, bc, ca}});
    }
    mesh.faces = std::move(faces);
  }
  return mesh;
}

/// A cube cut into squares and blown up, so that its points lie at equal angles along the middles of its sides.
SurfaceMesh unit_quad_sphere(int level) {
  refuse_if(level < 0 || level > 9, "a quad_ellipsoid of level {}, expected 0 to 9", level);
  SurfaceMesh mesh;
  const int cells = 1 << level;
  std::map<std::array<int, 3>, int> numbers;  // of points, by their places on the cube [0, cells]^3
  const auto number = [&](const std::array<int, 3>& place) {
    const auto [entry, is_new] = numbers.emplace(place, static_cast<int>(mesh.points.size()));
    if (is_new) {
      const auto coordinate = [cells](int i) { return std::tan(pi / 4 * (2.0 * i / cells - 1)); };
      mesh.points.push_back(
          Eigen::Vector3d(coordinate(place[0]), coordinate(place[1]), coordinate(place[2])).normalized());
    }
    return entry->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const bool is_far : {false, true}) {
      for (int j = 0; j < cells; ++j) {
        for (int i = 0; i < cells; ++i) {
          const auto corner = [&](int along, int across) {
            std::array<int, 3> place{};
            place[axis] = is_far ? cells : 0;
            place[(axis + 1) % 3] = is_far ? along : across;
            place[(axis + 2) % 3] = is_far ? across : along;
            return number(place);
          };
          mesh.faces.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)});
        }
      }
    }
  }
  return mesh;
}

/// @param mesh on the unit sphere
SurfaceMesh stretched(SurfaceMesh mesh, const Eigen::Vector3d& semi_axes) {
  require_above_0(semi_axes.minCoeff(), "an ellipsoid with a half axis");
  wrap_uv(mesh, [](const Eigen::Vector3d& point) { return 1 - std::acos(std::clamp(point.z(), -1.0, 1.0)) / pi; });
  for (Eigen::Vector3d& point : mesh.points) {
    point = point.cwiseProduct(semi_axes);
  }
  return mesh;
}

}  // namespace

SurfaceMesh icosphere_mesh(int level, double radius) {
  require_above_0(radius, "an icosphere with a radius");
  return ellipsoid_mesh(level, Eigen::Vector3d::Constant(radius));
}

SurfaceMesh ellipsoid_mesh(int level, const Eigen::Vector3d& semi_axes) {
  return stretched(unit_icosphere(level), semi_axes);
}

SurfaceMesh quad_ellipsoid_mesh(int level, const Eigen::Vector3d& semi_axes) {
  return stretched(unit_quad_sphere(level), semi_axes);
}

SurfaceMesh tube_mesh(double length, double radius, int vertices) {
  require_above_0(length, "a tube with a length");
  require_above_0(radius, "a tube with a radius");
  const Eigen::Vector3d half(radius, radius, radius + 0.5 * length);
  const auto distance = [&](const Eigen::Vector3d& point) {
    return distance_from_round_cone(point + Eigen::Vector3d(0, 0, 0.5 * length), radius, radius, length);
  };
  SurfaceMesh mesh = implicit_surface_mesh({distance, {-half, half}}, vertices, "a tube");
  wrap_uv(mesh, [&half](const Eigen::Vector3d& point) { return 0.5 + 0.5 * point.z() / half.z(); });
  return mesh;
}

}  // namespace pellicle::meshing
