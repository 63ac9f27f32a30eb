#include "surface/membrane.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/handle.h"
#include "meshing/weld.h"
#include "surface/distribution.h"
#include "surface/perturbation.h"

namespace pellicle {

namespace {

/// The mesh with faces and points numbered along its fronts (reverse Cuthill-McKee), so that what is near on the
/// surface is near in memory. The parts of the ranks inherit the order.
SurfaceMesh ordered(const SurfaceMesh& mesh) {
  std::vector<PetscInt> corners;
  for (const auto& face : mesh.faces) {
    corners.insert(corners.end(), face.begin(), face.end());
  }
  std::vector<double> coordinates(3 * mesh.points.size());
  const auto faces = static_cast<PetscInt>(mesh.faces.size());
  Handle<DM, DMDestroy> dm;
  Handle<IS, ISDestroy> permutation;
  const PetscInt* new_number = nullptr;  // of each face, then of each point
  check(DMPlexCreateFromCellListPetsc(PETSC_COMM_SELF, 2, faces, static_cast<PetscInt>(mesh.points.size()), 3,
                                      PETSC_FALSE, corners.data(), 3, coordinates.data(), dm.create()));
  check(DMPlexGetOrdering(dm, MATORDERINGRCM, nullptr, permutation.create()));
  check(ISGetIndices(permutation, &new_number));

  SurfaceMesh result = mesh;
  result.face_id.resize(mesh.faces.size());
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
    const auto to = static_cast<std::size_t>(new_number[face]);
    result.faces[to] = mesh.faces[face];
    result.face_id[to] = mesh.id_of_face(static_cast<int>(face));
    if (!mesh.uv.empty()) {
      result.uv[to] = mesh.uv[face];
    }
    for (const auto& [name, values] : mesh.face_fields) {
      result.face_fields[name][to] = values[face];
    }
  }
  std::vector<int> target(mesh.points.size());
  std::transform(new_number + faces, new_number + faces + target.size(), target.begin(),
                 [faces](PetscInt number) { return static_cast<int>(number - faces); });
  check(ISRestoreIndices(permutation, &new_number));
  renumber_points(result, target);
  return result;
}

/// The piece of each face, numbered by their lowest face in the file, and whether each piece is closed.
std::vector<int> find_pieces(const SurfaceMesh& mesh, const CellGraph& graph, std::vector<bool>& is_closed) {
  std::vector<int> by_id(mesh.faces.size());
  std::iota(by_id.begin(), by_id.end(), 0);
  std::sort(by_id.begin(), by_id.end(), [&mesh](int a, int b) { return mesh.id_of_face(a) < mesh.id_of_face(b); });
  std::vector<int> piece(mesh.faces.size(), -1);
  for (const int seed : by_id) {
    if (piece[static_cast<std::size_t>(seed)] >= 0) {
      continue;
    }
    const auto number = static_cast<int>(is_closed.size());
    std::vector<int> found{seed};
    piece[static_cast<std::size_t>(seed)] = number;
    bool closed = true;
    for (std::size_t next = 0; next < found.size(); ++next) {
      const auto face = static_cast<std::size_t>(found[next]);
      closed = closed && graph.offsets[face + 1] - graph.offsets[face] == 3;
      for (int k = graph.offsets[face]; k < graph.offsets[face + 1]; ++k) {
        const int neighbour = graph.neighbours[static_cast<std::size_t>(k)];
        if (piece[static_cast<std::size_t>(neighbour)] < 0) {
          piece[static_cast<std::size_t>(neighbour)] = number;
          found.push_back(neighbour);
        }
      }
    }
    is_closed.push_back(closed);
  }
  return piece;
}

void broadcast(MPI_Comm comm, std::vector<bool>& flags) {
  std::vector<int> numbers(flags.begin(), flags.end());
  auto count = static_cast<int>(numbers.size());
  MPI_Bcast(&count, 1, MPI_INT, 0, comm);
  numbers.resize(static_cast<std::size_t>(count));
  MPI_Bcast(numbers.data(), count, MPI_INT, 0, comm);
  flags.assign(numbers.begin(), numbers.end());
}

}  // namespace

Membrane make_membrane(MPI_Comm comm, const SurfaceMesh& mesh, const SheetOptions& options) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  Membrane membrane;
  SurfaceMesh whole;
  std::vector<std::string> fields;
  Distribution::Source source;
  if (rank == 0) {
    whole = ordered(mesh);
    const std::vector<int> piece = find_pieces(whole, cell_graph(whole), membrane.piece_is_closed);
    const auto faces = static_cast<Eigen::Index>(whole.faces.size());
    source = Distribution::source(whole);
    Eigen::MatrixXd& face_data = source.extra;  // piece, then the fields
    face_data.setZero(1 + static_cast<Eigen::Index>(whole.face_fields.size()),
                      faces + static_cast<Eigen::Index>(whole.points.size()));
    face_data.row(0).head(faces) = Eigen::Map<const Eigen::RowVectorXi>(piece.data(), faces).cast<double>();
    for (const auto& [name, values] : whole.face_fields) {
      fields.push_back(name);
      face_data.row(static_cast<Eigen::Index>(fields.size())).head(faces) =
          Eigen::Map<const Eigen::RowVectorXd>(values.data(), faces);
    }
  }
  broadcast(comm, fields);
  broadcast(comm, membrane.piece_is_closed);
  const Distribution distribution(comm, whole, std::move(source), 1, options);

  // Elements: owned ones, then those of other ranks with an owned vertex.
  const Distribution::Range cells = distribution.cells();
  std::vector<PetscInt> elements;
  std::vector<bool> is_used(static_cast<std::size_t>(distribution.points()), false);
  for (const bool owned : {true, false}) {
    for (PetscInt cell = cells.begin; cell < cells.end; ++cell) {
      const std::array<PetscInt, 3> corners = distribution.corners<3>(cell);
      const bool touches = std::any_of(corners.begin(), corners.end(),
                                       [&distribution](PetscInt corner) { return distribution.is_owned(corner); });
      if (distribution.is_owned(cell) == owned && (owned || touches)) {
        elements.push_back(cell);
        for (const PetscInt corner : corners) {
          is_used[static_cast<std::size_t>(corner)] = true;
        }
      }
    }
  }
  membrane.elements = distribution.layout(elements);

  // Particles: the vertices that elements use, owned ones first. Every owned vertex is in an owned cell or beside one.
  const Distribution::Range vertices = distribution.vertices();
  std::vector<PetscInt> particles;
  std::vector<PetscInt> particle_of_point(static_cast<std::size_t>(distribution.points()), -1);
  for (const bool owned : {true, false}) {
    for (PetscInt vertex = vertices.begin; vertex < vertices.end; ++vertex) {
      if (distribution.is_owned(vertex) == owned && is_used[static_cast<std::size_t>(vertex)]) {
        particle_of_point[static_cast<std::size_t>(vertex)] = static_cast<PetscInt>(particles.size());
        particles.push_back(vertex);
      }
    }
  }
  distribution.fill(membrane, particles);
  membrane.is_lattice.assign(particles.size(), false);
  membrane.cell_count.assign(static_cast<std::size_t>(membrane.particles.owned), 0);

  membrane.element_uv.resize(2, distribution.has_uv() ? static_cast<Eigen::Index>(elements.size()) : 0);
  for (const std::string& field : fields) {
    membrane.element_fields[field];
  }
  for (std::size_t e = 0; e < elements.size(); ++e) {
    std::array<PetscInt, 3> corners = distribution.corners<3>(elements[e]);
    for (PetscInt& corner : corners) {
      corner = particle_of_point[static_cast<std::size_t>(corner)];
      if (corner < membrane.particles.owned) {
        ++membrane.cell_count[static_cast<std::size_t>(corner)];
      }
    }
    membrane.triangles.push_back(corners);
    const Distribution::Data& data = distribution.data(elements[e]);
    const auto extra = distribution.extra(elements[e]);
    membrane.element_id.push_back(static_cast<PetscInt>(data.id));
    membrane.piece.push_back(static_cast<int>(extra[0]));
    if (distribution.has_uv()) {
      membrane.element_uv.col(static_cast<Eigen::Index>(e)) = Eigen::Map<const Eigen::Vector2d>(data.uv);
    }
    for (std::size_t f = 0; f < fields.size(); ++f) {
      membrane.element_fields[fields[f]].push_back(extra[static_cast<Eigen::Index>(f) + 1]);
    }
  }
  return membrane;
}

Eigen::Matrix3Xd perturbed_positions(const Membrane& membrane, const SheetOptions& options) {
  double sum = 0;
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    const auto& triangle = membrane.triangles[static_cast<std::size_t>(e)];
    for (std::size_t k = 0; k < 3; ++k) {
      sum += (membrane.rest.col(triangle[(k + 1) % 3]) - membrane.rest.col(triangle[k])).norm();
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, membrane.comm());
  return perturbed_positions(membrane, options, sum / (3 * static_cast<double>(membrane.elements.global)));
}

}  // namespace pellicle
