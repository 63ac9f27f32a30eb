#include <petscdmplex.h>

#include <algorithm>
#include <fstream>

#include "base/error.h"
#include "base/handle.h"
#include "mesh/format_readers.h"

namespace pellicle {
namespace {

using DmHandle = Handle<DM, DMDestroy>;
using ViewerHandle = Handle<PetscViewer, PetscViewerDestroy>;
using OptionsHandle = Handle<PetscOptions, PetscOptionsDestroy>;

/// While it lives PETSc prints no errors; the message of the first is kept.
class QuietErrors {
 public:
  QuietErrors() { PetscPushErrorHandler(&QuietErrors::keep, this); }
  ~QuietErrors() { PetscPopErrorHandler(); }
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;

  const std::string& message() const { return message_; }

 private:
  static PetscErrorCode keep(MPI_Comm /*comm*/, int /*line*/, const char* /*function*/, const char* /*file*/,
                             PetscErrorCode code, PetscErrorType type, const char* message, void* self) {
    if (type == PETSC_ERROR_INITIAL && message != nullptr) {
      static_cast<QuietErrors*>(self)->message_ = message;
    }
    return code;
  }

  std::string message_;
};

/// Text or binary: the second number of the header.
PetscViewerType viewer_type(const std::string& path) {
  std::ifstream stream(path);
  std::string word;
  double version = 0;
  int binary = 0;
  if (!(stream >> word) || word != "$MeshFormat" || !(stream >> version >> binary)) {
    throw Error(path + ":1: '" + word.substr(0, 40) + "', expected $MeshFormat of a Gmsh mesh of version 2.2 to 4.1");
  }
  return binary != 0 ? PETSCVIEWERBINARY : PETSCVIEWERASCII;
}

/// Vertices of the closure of a plex point, in order round it for a cell.
std::vector<int> vertices_of(DM dm, PetscInt point, PetscInt first_vertex, PetscInt end_vertex) {
  PetscInt size = 0;
  PetscInt* closure = nullptr;
  check(DMPlexGetTransitiveClosure(dm, point, PETSC_TRUE, &size, &closure));
  std::vector<int> vertices;
  for (PetscInt i = 0; i < size; ++i) {
    if (closure[2 * i] >= first_vertex && closure[2 * i] < end_vertex) {
      vertices.push_back(static_cast<int>(closure[2 * i] - first_vertex));
    }
  }
  check(DMPlexRestoreTransitiveClosure(dm, point, PETSC_TRUE, &size, &closure));
  return vertices;
}

SurfaceMesh extract(DM dm, const std::string& path) {
  PetscInt dimension = 0;
  check(DMGetDimension(dm, &dimension));
  if (dimension != 2) {
    throw Error(path + ": elements of dimension " + std::to_string(dimension) + ", expected triangles and quads");
  }
  SurfaceMesh mesh;
  PetscInt first_vertex = 0;
  PetscInt end_vertex = 0;
  check(DMPlexGetDepthStratum(dm, 0, &first_vertex, &end_vertex));
  PetscInt coordinate_dimension = 0;
  check(DMGetCoordinateDim(dm, &coordinate_dimension));
  Vec coordinates = nullptr;  // belongs to the DM
  check(DMGetCoordinatesLocal(dm, &coordinates));
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(coordinates, &values));
  for (PetscInt i = 0; i < end_vertex - first_vertex; ++i) {
    Eigen::Vector3d& point = mesh.points.emplace_back(Eigen::Vector3d::Zero());
    std::copy_n(values + i * coordinate_dimension, coordinate_dimension, point.data());
  }
  check(VecRestoreArrayRead(coordinates, &values));

  PetscInt first_cell = 0;
  PetscInt end_cell = 0;
  check(DMPlexGetHeightStratum(dm, 0, &first_cell, &end_cell));
  for (PetscInt cell = first_cell; cell < end_cell; ++cell) {
    mesh.faces.push_back(vertices_of(dm, cell, first_vertex, end_vertex));
  }

  PetscInt labels = 0;
  check(DMGetNumLabels(dm, &labels));
  for (PetscInt i = 0; i < labels; ++i) {
    const char* name = nullptr;
    check(DMGetLabelName(dm, i, &name));
    const std::string label_name = name;
    if (label_name == "celltype" || label_name == "depth") {
      continue;  // PETSc's own
    }
    // Groups without names are gathered by PETSc in "Cell Sets", "Face Sets" and "Vertex Sets", and known by their tags.
    const bool unnamed = label_name.size() > 5 && label_name.substr(label_name.size() - 5) == " Sets";
    DMLabel label = nullptr;  // belongs to the DM
    check(DMGetLabel(dm, name, &label));
    IsHandle tags;
    check(DMLabelGetValueIS(label, tags.create()));
    PetscInt tag_count = 0;
    check(ISGetLocalSize(tags, &tag_count));
    const PetscInt* tag = nullptr;
    check(ISGetIndices(tags, &tag));
    for (PetscInt t = 0; t < tag_count; ++t) {
      std::vector<int>& members = mesh.groups[unnamed ? std::to_string(tag[t]) : label_name];
      IsHandle items;
      check(DMLabelGetStratumIS(label, tag[t], items.create()));
      PetscInt item_count = 0;
      check(ISGetLocalSize(items, &item_count));
      const PetscInt* item = nullptr;
      check(ISGetIndices(items, &item));
      for (PetscInt k = 0; k < item_count; ++k) {
        const std::vector<int> vertices = vertices_of(dm, item[k], first_vertex, end_vertex);
        members.insert(members.end(), vertices.begin(), vertices.end());
      }
      check(ISRestoreIndices(items, &item));
    }
    check(ISRestoreIndices(tags, &tag));
  }
  for (auto& entry : mesh.groups) {
    std::vector<int>& members = entry.second;
    std::sort(members.begin(), members.end());
    members.erase(std::unique(members.begin(), members.end()), members.end());
  }
  return mesh;
}

}  // namespace

SurfaceMesh read_gmsh(const std::string& path) {
  const PetscViewerType type = viewer_type(path);
  // Options of the reader's own, so that the user's database stays as it is: named groups, also of points, in space.
  OptionsHandle options;
  check(PetscOptionsCreate(options.create()));
  check(PetscOptionsSetValue(options, "-dm_plex_gmsh_use_regions", "true"));
  check(PetscOptionsSetValue(options, "-dm_plex_gmsh_mark_vertices", "true"));
  check(PetscOptionsSetValue(options, "-dm_plex_gmsh_spacedim", "3"));
  ViewerHandle viewer;
  check(PetscViewerCreate(PETSC_COMM_SELF, viewer.create()));
  check(PetscObjectSetOptions(reinterpret_cast<PetscObject>(static_cast<PetscViewer>(viewer)), options));
  check(PetscViewerSetType(viewer, type));
  check(PetscViewerFileSetMode(viewer, FILE_MODE_READ));

  DmHandle dm;
  {
    QuietErrors quiet;
    try {
      check(PetscViewerFileSetName(viewer, path.c_str()));
      check(DMPlexCreateGmsh(PETSC_COMM_SELF, viewer, PETSC_TRUE, dm.create()));
    } catch (const PetscFailure&) {
      throw Error(path + ": PETSc cannot read it as a Gmsh mesh: " + quiet.message());
    }
  }
  return extract(dm, path);
}

}  // namespace pellicle
