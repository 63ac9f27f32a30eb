#include "meshing/generators.h"

#include <fmt/format.h>

#include <cmath>

#include "base/error.h"
#include "geometry/pi.h"

namespace pellicle::meshing {

namespace {

void require_cells(std::array<int, 2> cells, int lowest, const char* shape, int faces_of_a_cell) {
  const std::string what = fmt::format("a {} of {} x {} cells", shape, cells[0], cells[1]);
  refuse_if(cells[0] < lowest || cells[1] < lowest, "{}, expected at least {} x {}", what, lowest, lowest);
  require_mesh_size(what, static_cast<double>(faces_of_a_cell) * cells[0] * cells[1]);
}

void require_size(std::array<double, 2> size, const char* shape) {
  refuse_if(!(size[0] > 0 && size[1] > 0), "a {} of {:g} m x {:g} m, expected sizes above 0", shape, size[0], size[1]);
}

/// Gives a mesh the texture coordinates of its points, and groups of the points at which these are 0 or 1.
SurfaceMesh with_sides(SurfaceMesh mesh, const std::vector<Eigen::Vector2d>& uv) {
  const auto name_where = [&](const char* name, int axis, double end) {
    std::vector<int>& members = mesh.groups[name];
    for (std::size_t i = 0; i < uv.size(); ++i) {
      if (uv[i][axis] == end) {
        members.push_back(static_cast<int>(i));
      }
    }
  };
  name_where("left", 0, 0);
  name_where("right", 0, 1);
  name_where("bottom", 1, 0);
  name_where("top", 1, 1);
  mesh.uv = uv_of_corners(mesh, uv);
  return mesh;
}

}  // namespace

SurfaceMesh rectangle_mesh(std::array<int, 2> cells, std::array<double, 2> size) {
  require_cells(cells, 1, "rectangle", 1);
  require_size(size, "rectangle");
  const auto [nx, ny] = cells;
  SurfaceMesh mesh;
  std::vector<Eigen::Vector2d> uv;
  for (int j = 0; j <= ny; ++j) {
    for (int i = 0; i <= nx; ++i) {
      const Eigen::Vector2d& here = uv.emplace_back(static_cast<double>(i) / nx, static_cast<double>(j) / ny);
      mesh.points.emplace_back((here.x() - 0.5) * size[0], (here.y() - 0.5) * size[1], 0);
    }
  }
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const int corner = i + (nx + 1) * j;
      mesh.faces.push_back({corner, corner + 1, corner + nx + 2, corner + nx + 1});
    }
  }
  return with_sides(std::move(mesh), uv);
}

SurfaceMesh torus_mesh(std::array<int, 2> cells, double major_radius, double tube_radius) {
  require_cells(cells, 3, "torus", 1);
  refuse_if(!(tube_radius > 0 && tube_radius < major_radius),
            "a torus of radii {:g} m and {:g} m, expected the second between 0 and the first", major_radius,
            tube_radius);
  const auto [n, m] = cells;
  SurfaceMesh mesh;
  for (int j = 0; j < m; ++j) {
    const double tube = 2 * pi * j / m;
    for (int i = 0; i < n; ++i) {
      const double round = 2 * pi * i / n;
      const double distance = major_radius + tube_radius * std::cos(tube);
      mesh.points.emplace_back(distance * std::cos(round), distance * std::sin(round), tube_radius * std::sin(tube));
    }
  }
  const auto point = [n = n, m = m](int i, int j) { return i % n + n * (j % m); };
  const auto uv = [n = n, m = m](double i, double j) { return Eigen::Vector2d(i / n, j / m); };
  for (int j = 0; j < m; ++j) {
    for (int i = 0; i < n; ++i) {
      mesh.faces.push_back({point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)});
      mesh.uv.push_back({uv(i, j), uv(i + 1, j), uv(i + 1, j + 1), uv(i, j + 1)});
    }
  }
  return mesh;
}

SurfaceMesh roof_mesh(std::array<int, 2> cells, std::array<double, 2> size, double arch) {
  require_cells(cells, 2, "roof", 2);
  require_size(size, "roof");
  refuse_if(!(arch > 0 && arch < 2 * pi), "a roof with an arch of {:f} rad, expected between 0 and a full turn", arch);
  const auto [n, m] = cells;
  const double radius = size[1] / arch;
  // Points sit at half-cell steps (a, b), a + b odd; quads have their centres at a + b even, and the two families of
  // centres are the teeth with a and b odd and the cells between them.
  SurfaceMesh mesh;
  std::vector<Eigen::Vector2d> uv;
  Eigen::ArrayXXi at = Eigen::ArrayXXi::Constant(2 * n + 1, 2 * m + 1, -1);  // number of the point
  for (int b = 0; b <= 2 * m; ++b) {
    for (int a = 1 - b % 2; a <= 2 * n; a += 2) {
      // The outer points of the four corner quads, which are left out.
      const bool end_column = a <= 1 || a >= 2 * n - 1;
      const bool end_row = b <= 1 || b >= 2 * m - 1;
      if (end_column && end_row) {
        continue;
      }
      at(a, b) = static_cast<int>(mesh.points.size());
      const Eigen::Vector2d& here = uv.emplace_back(a / (2.0 * n), b / (2.0 * m));
      const double angle = (here.y() - 0.5) * arch;
      mesh.points.emplace_back((here.x() - 0.5) * size[0], radius * std::sin(angle), radius * std::cos(angle));
    }
  }
  for (int b = 1; b < 2 * m; ++b) {
    for (int a = 2 - b % 2; a < 2 * n; a += 2) {
      const bool corner = (a == 1 || a == 2 * n - 1) && (b == 1 || b == 2 * m - 1);
      if (!corner) {
        mesh.faces.push_back({at(a, b - 1), at(a + 1, b), at(a, b + 1), at(a - 1, b)});
      }
    }
  }
  return with_sides(std::move(mesh), uv);
}

SurfaceMesh disc_mesh(int rings, double radius) {
  refuse_if(rings < 1 || !(radius > 0), "a disc of {} rings and radius {:f} m, expected both above 0", rings, radius);
  require_mesh_size(fmt::format("a disc of {} rings", rings), 6.0 * rings * rings);
  SurfaceMesh mesh;
  std::vector<Eigen::Vector2d> uv;
  const auto add_point = [&](double distance, double angle) {
    const Eigen::Vector2d place(distance * std::cos(angle), distance * std::sin(angle));
    mesh.points.emplace_back(radius * place.x(), radius * place.y(), 0);
    uv.emplace_back(0.5 + 0.5 * place.x(), 0.5 + 0.5 * place.y());
  };
  add_point(0, 0);
  for (int k = 1; k <= rings; ++k) {
    for (int i = 0; i < 6 * k; ++i) {
      add_point(static_cast<double>(k) / rings, 2 * pi * i / (6 * k));
    }
  }
  const auto point = [](int ring, int i) { return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1) + i % (6 * ring); };
  for (int k = 1; k <= rings; ++k) {
    for (int sector = 0; sector < 6; ++sector) {
      const int inner = sector * (k - 1);
      const int outer = sector * k;
      for (int i = 0; i < k; ++i) {
        mesh.faces.push_back({point(k - 1, inner + i), point(k, outer + i), point(k, outer + i + 1)});
        if (i + 1 < k) {
          mesh.faces.push_back({point(k - 1, inner + i), point(k, outer + i + 1), point(k - 1, inner + i + 1)});
        }
      }
    }
  }
  mesh.uv = uv_of_corners(mesh, uv);
  mesh.groups["centre"] = {0};
  for (int i = 0; i < 6 * rings; ++i) {
    mesh.groups["rim"].push_back(point(rings, i));
  }
  return mesh;
}

SurfaceMesh square_mesh(std::array<int, 2> cells, std::array<double, 2> size) {
  require_cells(cells, 1, "square", 4);
  require_size(size, "square");
  const auto [nx, ny] = cells;
  SurfaceMesh mesh;
  std::vector<Eigen::Vector2d> uv;
  const auto add_point = [&, nx = nx, ny = ny](double i, double j) {
    const Eigen::Vector2d& here = uv.emplace_back(i / nx, j / ny);
    mesh.points.emplace_back(here.x() * size[0], here.y() * size[1], 0);
  };
  for (int j = 0; j <= ny; ++j) {
    for (int i = 0; i <= nx; ++i) {
      add_point(i, j);
    }
  }
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const int corner = i + (nx + 1) * j;
      const int middle = static_cast<int>(mesh.points.size());
      add_point(i + 0.5, j + 0.5);
      mesh.faces.push_back({corner, corner + 1, middle});
      mesh.faces.push_back({corner + 1, corner + nx + 2, middle});
      mesh.faces.push_back({corner + nx + 2, corner + nx + 1, middle});
      mesh.faces.push_back({corner + nx + 1, corner, middle});
    }
  }
  return with_sides(std::move(mesh), uv);
}

}  // namespace pellicle::meshing
