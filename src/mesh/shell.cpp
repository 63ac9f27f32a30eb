#include "mesh/shell.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "mesh/distribution.h"
#include "mesh/perturbation.h"

namespace pellicle {

namespace {

/// What rank 0 knows of the shell at each cell, then each vertex: mass and, of a cell, the position of its lattice
/// point.
Eigen::MatrixXd masses_and_lattice(const SurfaceMesh& mesh, const SheetOptions& options) {
  const std::size_t cells = mesh.faces.size();
  Eigen::MatrixXd data = Eigen::MatrixXd::Zero(4, static_cast<Eigen::Index>(cells + mesh.points.size()));
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const auto& face = mesh.faces[cell];
    const std::array<Eigen::Vector3d, 4> corner{
        mesh.points[static_cast<std::size_t>(face[0])], mesh.points[static_cast<std::size_t>(face[1])],
        mesh.points[static_cast<std::size_t>(face[2])], mesh.points[static_cast<std::size_t>(face[3])]};
    const Eigen::Vector3d twice_area = (corner[2] - corner[0]).cross(corner[3] - corner[1]);
    const Eigen::Vector3d normal = twice_area.normalized();
    const Eigen::Vector3d centre = (corner[0] + corner[1] + corner[2] + corner[3]) / 4;
    const double mass = options.areal_density * twice_area.norm() / 2;
    data.col(static_cast<Eigen::Index>(cell)) << mass / 2, centre + options.thickness * normal;
    for (const int vertex : face) {
      data(0, static_cast<Eigen::Index>(cells) + vertex) += mass / 8;
    }
  }
  return data;
}

/// A spring as it is found at a mesh point (its cell or edge), before owned ones are sorted to the front.
struct FoundSpring {
  PetscInt point;  ///< DMPlex cell (red, yellow) or edge (blue, green)
  PetscInt index;  ///< among the springs of this colour at the point
  std::array<PetscInt, 2> ends;
  std::array<PetscInt, 4> triangles;  ///< SpringSet::triangles
};

/// Which side of a cell joins these corners: k when it runs between corners k and k + 1.
PetscInt side(const std::array<PetscInt, 4>& cell, const std::array<PetscInt, 2>& ends) {
  PetscInt k = 0;
  while (std::minmax(cell[static_cast<std::size_t>(k)], cell[static_cast<std::size_t>((k + 1) % 4)]) !=
         std::minmax(ends[0], ends[1])) {
    ++k;
  }
  return k;
}

/// Orders springs owned first, numbers them, and drops those that neither end at a particle of this rank, nor share one
/// with an owned spring, nor lie in an owned cell. Collective.
SpringSet make_spring_set(const std::vector<FoundSpring>& found, const Distribution& distribution, const Sheet& sheet) {
  SpringSet set;
  std::vector<PetscInt> first_at_point(static_cast<std::size_t>(distribution.points()), -1);
  std::vector<bool> needed(static_cast<std::size_t>(sheet.particles.local()), false);
  std::fill_n(needed.begin(), sheet.particles.owned, true);
  const auto add = [&](const FoundSpring& spring) {
    set.ends.push_back(spring.ends);
    set.triangles.push_back(spring.triangles);
    set.initial_length.push_back((sheet.rest.col(spring.ends[0]) - sheet.rest.col(spring.ends[1])).norm());
  };
  for (const FoundSpring& spring : found) {
    if (distribution.is_owned(spring.point)) {
      if (spring.index == 0) {
        first_at_point[static_cast<std::size_t>(spring.point)] = static_cast<PetscInt>(set.ends.size());
      }
      add(spring);
      needed[static_cast<std::size_t>(spring.ends[0])] = true;
      needed[static_cast<std::size_t>(spring.ends[1])] = true;
    }
  }
  number_owned(set.layout, sheet.comm(), static_cast<PetscInt>(set.ends.size()));
  for (PetscInt& number : first_at_point) {
    number += number >= 0 ? set.layout.first : 0;
  }
  distribution.fetch(first_at_point);
  for (const FoundSpring& spring : found) {
    const bool is_needed =
        needed[static_cast<std::size_t>(spring.ends[0])] || needed[static_cast<std::size_t>(spring.ends[1])] ||
        std::any_of(spring.triangles.begin(), spring.triangles.end(),
                    [&sheet](PetscInt triangle) { return triangle >= 0 && triangle < 4 * sheet.owned_cells; });
    if (!distribution.is_owned(spring.point) && is_needed) {
      set.layout.ghost_global.push_back(first_at_point[static_cast<std::size_t>(spring.point)] + spring.index);
      add(spring);
    }
  }
  return set;
}

}  // namespace

Sheet make_sheet(MPI_Comm comm, const SurfaceMesh& mesh, const SheetOptions& options) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  Sheet sheet;
  Eigen::MatrixXd shell;
  std::array<PetscInt, 4> sizes{};
  if (rank == 0) {
    const auto points = static_cast<PetscInt>(mesh.points.size());
    const auto faces = static_cast<PetscInt>(mesh.faces.size());
    const PetscInt first_lattice_id = mesh.id_of_point(points - 1) + 1;
    sizes = {points, faces, first_lattice_id, first_lattice_id + mesh.id_of_face(faces - 1) + 1};
    shell = masses_and_lattice(mesh, options);
  }
  MPI_Bcast(sizes.data(), static_cast<int>(sizes.size()), MPIU_INT, 0, comm);
  sheet.global_corners = sizes[0];
  sheet.global_cells = sizes[1];
  sheet.first_lattice_id = sizes[2];
  sheet.id_end = sizes[3];
  // Two layers of neighbours: a green spring's neighbours end one cell beyond the next cell.
  const Distribution distribution(comm, mesh, 2, options, std::move(shell));

  // Particles: owned corners, owned lattice points, ghost corners, ghost lattice points.
  const Distribution::Range cells = distribution.cells();
  std::vector<PetscInt> point_of_particle;
  std::vector<PetscInt> particle_of_point(static_cast<std::size_t>(distribution.points()), -1);
  for (const bool owned : {true, false}) {
    for (const Distribution::Range& range : {distribution.vertices(), cells}) {
      for (PetscInt point = range.begin; point < range.end; ++point) {
        if (distribution.is_owned(point) == owned) {
          const bool is_lattice = point >= cells.begin && point < cells.end;
          particle_of_point[static_cast<std::size_t>(point)] = static_cast<PetscInt>(point_of_particle.size());
          point_of_particle.push_back(point);
          sheet.is_lattice.push_back(is_lattice);
          sheet.owned_corners += owned && !is_lattice ? 1 : 0;
        }
      }
    }
  }
  distribution.fill(sheet, point_of_particle);
  for (std::size_t i = 0; i < point_of_particle.size(); ++i) {
    const auto extra = distribution.extra(point_of_particle[i]);
    sheet.initial_mass.push_back(extra[0]);
    if (sheet.is_lattice[i]) {
      sheet.rest.col(static_cast<Eigen::Index>(i)) = extra.tail<3>();
      sheet.persistent_id[i] += sheet.first_lattice_id;
    }
  }

  // Cells, owned first, and the springs that belong to a cell.
  std::vector<FoundSpring> red;
  std::vector<FoundSpring> yellow;
  std::vector<PetscInt> cell_of_point(static_cast<std::size_t>(distribution.points()), -1);
  sheet.cell_count.assign(static_cast<std::size_t>(sheet.particles.owned), 0);
  for (const bool owned : {true, false}) {
    for (PetscInt point = cells.begin; point < cells.end; ++point) {
      if (distribution.is_owned(point) != owned) {
        continue;
      }
      const PetscInt lattice = particle_of_point[static_cast<std::size_t>(point)];
      const auto triangle = 4 * static_cast<PetscInt>(sheet.cells.size());
      const std::array<PetscInt, 4> triangles{triangle, triangle + 1, triangle + 2, triangle + 3};
      std::array<PetscInt, 4> corners = distribution.corners<4>(point);
      for (std::size_t k = 0; k < 4; ++k) {
        corners[k] = particle_of_point[static_cast<std::size_t>(corners[k])];
        red.push_back(
            {point, static_cast<PetscInt>(k), {corners[k], lattice}, {triangles[k], triangles[(k + 3) % 4], -1, -1}});
        if (corners[k] < sheet.owned_corners) {
          ++sheet.cell_count[static_cast<std::size_t>(corners[k])];
        }
      }
      yellow.push_back({point, 0, {corners[0], corners[2]}, triangles});
      yellow.push_back({point, 1, {corners[1], corners[3]}, triangles});
      cell_of_point[static_cast<std::size_t>(point)] = static_cast<PetscInt>(sheet.cells.size());
      sheet.cells.push_back(corners);
      sheet.lattice.push_back(lattice);
      sheet.owned_cells += owned ? 1 : 0;
    }
  }

  // Springs along and across the edges of the cells.
  std::vector<FoundSpring> blue;
  std::vector<FoundSpring> green;
  const Distribution::Range edges = distribution.edges();
  for (PetscInt edge = edges.begin; edge < edges.end; ++edge) {
    const PetscInt* vertices = nullptr;
    const PetscInt* beside = nullptr;
    PetscInt count = 0;
    check(DMPlexGetCone(distribution.dm(), edge, &vertices));
    check(DMPlexGetSupportSize(distribution.dm(), edge, &count));
    check(DMPlexGetSupport(distribution.dm(), edge, &beside));
    const std::array<PetscInt, 2> ends{particle_of_point[static_cast<std::size_t>(vertices[0])],
                                       particle_of_point[static_cast<std::size_t>(vertices[1])]};
    std::array<PetscInt, 4> triangles{-1, -1, -1, -1};
    for (PetscInt i = 0; i < count; ++i) {
      const PetscInt cell = cell_of_point[static_cast<std::size_t>(beside[i])];
      triangles[static_cast<std::size_t>(i)] = 4 * cell + side(sheet.cells[static_cast<std::size_t>(cell)], ends);
    }
    blue.push_back({edge, 0, ends, triangles});
    if (count == 2) {
      green.push_back({edge,
                       0,
                       {particle_of_point[static_cast<std::size_t>(beside[0])],
                        particle_of_point[static_cast<std::size_t>(beside[1])]},
                       triangles});
    }
  }
  sheet.of(Colour::red) = make_spring_set(red, distribution, sheet);
  sheet.of(Colour::green) = make_spring_set(green, distribution, sheet);
  sheet.of(Colour::blue) = make_spring_set(blue, distribution, sheet);
  sheet.of(Colour::yellow) = make_spring_set(yellow, distribution, sheet);
  return sheet;
}

Eigen::Matrix3Xd perturbed_positions(const Sheet& sheet, const SheetOptions& options) {
  const SpringSet& blue = sheet.of(Colour::blue);
  double sum = std::accumulate(blue.initial_length.begin(), blue.initial_length.begin() + blue.owned(), 0.0);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, sheet.comm());
  return perturbed_positions(sheet, options, sum / static_cast<double>(blue.layout.global));
}

}  // namespace pellicle
