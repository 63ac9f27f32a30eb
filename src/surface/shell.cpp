#include "surface/shell.h"

#include <array>
#include <numeric>
#include <utility>

#include "geometry/quad_area.h"
#include "surface/distribution.h"
#include "surface/perturbation.h"
#include "surface/shell_assembly.h"

namespace pellicle {

namespace {

/// What rank 0 knows of the shell: ids, places and masses of the lattice points and of the corners.
Distribution::Source shell_source(const SurfaceMesh& mesh, PetscInt first_lattice_id, const SheetOptions& options) {
  Distribution::Source source = Distribution::source(mesh);
  const std::size_t cells = mesh.faces.size();
  source.extra.setZero(1, static_cast<Eigen::Index>(source.data.size()));
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const auto& face = mesh.faces[cell];
    const auto corner = [&](std::size_t k) { return mesh.points[static_cast<std::size_t>(face[k])]; };
    const Eigen::Vector3d area = quad_area_vector(corner(0), corner(1), corner(2), corner(3));
    const double mass = options.areal_density * area.norm();
    source.data[cell].id += first_lattice_id;
    Eigen::Map<Eigen::Vector3d>(source.data[cell].position) += options.thickness * area.normalized();
    source.extra(0, static_cast<Eigen::Index>(cell)) = mass / 2;
    for (const int vertex : face) {
      source.extra(0, static_cast<Eigen::Index>(cells) + vertex) += mass / 8;
    }
  }
  return source;
}

}  // namespace

Sheet make_sheet(MPI_Comm comm, const SurfaceMesh& mesh, const SheetOptions& options) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  Distribution::Source source;
  std::array<PetscInt, 2> ids{};  // first of a lattice point, end
  if (rank == 0) {
    ids[0] = mesh.id_of_point(static_cast<int>(mesh.points.size()) - 1) + 1;
    ids[1] = ids[0] + mesh.id_of_face(static_cast<int>(mesh.faces.size()) - 1) + 1;
    source = shell_source(mesh, ids[0], options);
  }
  MPI_Bcast(ids.data(), static_cast<int>(ids.size()), MPIU_INT, 0, comm);
  Sheet sheet = assemble_shell(Distribution(comm, mesh, std::move(source), shell_layers, options)).sheet;
  sheet.first_lattice_id = ids[0];
  sheet.id_end = ids[1];
  return sheet;
}

Eigen::Matrix3Xd perturbed_positions(const Sheet& sheet, const SheetOptions& options) {
  const SpringSet& blue = sheet.of(Colour::blue);
  double sum = std::accumulate(blue.initial_length.begin(), blue.initial_length.begin() + blue.owned(), 0.0);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, sheet.comm());
  return perturbed_positions(sheet, options, sum / static_cast<double>(blue.layout.global));
}

}  // namespace pellicle
