#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "meshing/blobs.h"
#include "meshing/mesh_check.h"
#include "meshing/surface_mesh.h"
#include "options/choice.h"

namespace pellicle::meshing {

/// Shapes of generated meshes, as in `describe`; file needs `MeshOptions::file`.
enum class MeshShape {
  rectangle,
  torus,
  roof,
  shirt,
  icosphere,
  ellipsoid,
  tube,
  blobs,
  disc,
  square,
  quad_ellipsoid,
  file
};
inline std::vector<std::string> names_of(MeshShape) {
  return {"rectangle", "torus", "roof", "shirt",  "icosphere",      "ellipsoid",
          "tube",      "blobs", "disc", "square", "quad_ellipsoid", "file"};
}

/// Source and placement of the mesh.
struct MeshOptions {
  Choice<MeshShape> shape = MeshShape::rectangle;
  std::string file;                           ///< mesh to read instead of generating one, if not empty
  std::vector<int> cells{40, 40};             ///< of the generated mesh, each way
  std::vector<double> size{1, 1};             ///< of the generated mesh, each way [m]
  double major_radius = 0.5;                  ///< torus: of the circle in the middle of the tube [m]
  double tube_radius = 0.2;                   ///< torus: of the tube [m]
  double arch = 2.0943951023931953;           ///< roof: angle of its arc [rad]
  int level = 4;                              ///< icosphere and ellipsoids: how often icosahedron or cube are split
  double radius = 0.1;                        ///< icosphere, tube and disc [m]
  Eigen::Vector3d semi_axes{0.1, 0.1, 0.15};  ///< ellipsoids: half axes along x, y, z [m]
  double length = 0.3;                        ///< tube: of its cylinder [m]
  int rings = 20;                             ///< disc: of triangles
  int vertices = 10000;                       ///< tube and blobs
  std::map<std::string, BlobOptions> blobs;   ///< solids of the surface of shape blobs
  double scale = 1;                           ///< factor on file or shape, about the origin
  std::optional<double> volume;               ///< to which a closed mesh is then scaled, about the origin [m^3]
  bool merge = true;                          ///< points at the same place become one
  double merge_distance = 0;                  ///< points no further apart are at the same place [m]
  Eigen::Vector3d rotation{0, 0, 0};  ///< then turned about the axes x, y, z through the origin, in this order [rad]
  Eigen::Vector3d shift{0, 0, 0};     ///< then moved [m]

  /// Whether the file is one that -mesh_only writes: checked, in its place, with its partition.
  bool has_partition() const { return file.size() > 3 && file.compare(file.size() - 3, 3, ".h5") == 0; }
  /// Name of the mesh in messages: the file, or the shape.
  const std::string& name() const { return file.empty() ? shape.name() : file; }
};

void describe(OptionTable& table, MeshOptions& options);

/// Reads or generates the mesh and puts it in place: a point p goes to shift + Rz Ry Rx (scale p), all about the origin
/// of the file's coordinates; generated shapes lie round the origin. Unchecked and not yet scaled to the volume, see
/// make_checked_mesh. Not collective.
/// @throws Error on a bad file or bad parameters.
SurfaceMesh make_mesh(const MeshOptions& options);

struct CheckedMesh {
  SurfaceMesh mesh;
  MeshReport report;
};

/// Makes the mesh of the options, checks and repairs it, and scales it to the given volume, about the origin of the
/// file's coordinates. Not collective.
/// @throws Error as make_mesh and check_and_repair do, and if a volume is given for an open mesh
CheckedMesh make_checked_mesh(const MeshOptions& options);

}  // namespace pellicle::meshing
