#include "mesh/mesh_options.h"

#include <Eigen/Geometry>

#include "base/error.h"
#include "base/options.h"
#include "mesh/generators.h"
#include "mesh/readers.h"

namespace pellicle {

void describe(OptionTable& table, MeshOptions& options) {
  table.add("mesh.shape", options.shape)
      .choices({"rectangle", "torus", "roof", "file"})
      .help(
          "mesh to generate: a flat rectangle, a torus round the z axis, a roof (an arch of quads that stand on their "
          "points, so that its boundary is a zigzag); a file, when mesh.file names one, takes its place");
  table.add("mesh.file", options.file)
      .file()
      .help("mesh to read, whatever mesh.shape says: obj, off, ply, stl, vtp, vtu, vtk or msh; empty: generate one");
  table.add("mesh.cells", options.cells)
      .length(2)
      .at_least(1)
      .help("cells of the generated mesh along its length and width; torus: round the axis and round the tube");
  table.add("mesh.size", options.size)
      .length(2)
      .more_than(0)
      .unit("m")
      .help("length and width of rectangle and roof, the roof's width along its arc");
  table.add("mesh.major_radius", options.major_radius)
      .more_than(0)
      .unit("m")
      .help("torus: radius of the circle in the middle of the tube");
  table.add("mesh.tube_radius", options.tube_radius).more_than(0).unit("m").help("torus: radius of the tube");
  table.add("mesh.arch", options.arch).more_than(0).unit("rad").help("roof: angle of its arc");
  table.add("mesh.scale", options.scale).more_than(0).help("factor on all coordinates, such as 0.001 for a file in mm");
  table.add("mesh.rotation", options.rotation)
      .unit("rad")
      .help("then turned by these angles about the axes x, y and z, in this order, through the origin");
  table.add("mesh.shift", options.shift).unit("m").help("then moved by this vector");
}

SurfaceMesh make_mesh(const MeshOptions& options) {
  SurfaceMesh mesh;
  if (!options.file.empty()) {
    mesh = read_mesh(options.file);
  } else if (options.shape == "file") {
    throw Error("mesh.shape: 'file', but mesh.file is empty, expected the name of a mesh file");
  } else {
    const std::array<int, 2> cells{options.cells.at(0), options.cells.at(1)};
    const std::array<double, 2> size{options.size.at(0), options.size.at(1)};
    if (options.shape == "torus") {
      mesh = torus_mesh(cells, options.major_radius, options.tube_radius);
    } else if (options.shape == "roof") {
      mesh = roof_mesh(cells, size, options.arch);
    } else {
      mesh = rectangle_mesh(cells, size);
    }
  }
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(options.rotation.z(), Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(options.rotation.y(), Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(options.rotation.x(), Eigen::Vector3d::UnitX()))
                                       .toRotationMatrix();
  for (Eigen::Vector3d& point : mesh.points) {
    point = options.shift + rotation * (options.scale * point);
  }
  return mesh;
}

}  // namespace pellicle
