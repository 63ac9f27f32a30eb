#include "meshing/mesh_options.h"

#include <array>
#include <cmath>

#include "base/error.h"
#include "geometry/pi.h"
#include "meshing/closed_shapes.h"
#include "meshing/generators.h"
#include "meshing/readers.h"
#include "options/options.h"

namespace pellicle::meshing {

void describe(OptionTable& table, MeshOptions& options) {
  // A file takes the place of a generated mesh.
  const Condition generated{"no mesh.file", [&options] { return options.file.empty(); }};
  const auto of = [&](const std::vector<MeshShape>& shapes, const std::string& unit = "1") {
    return Rules(unit).acts_with(generated).acts_with(one_of("mesh.shape", options.shape, shapes));
  };
  table.add(
      "mesh.shape", options.shape,
      Rules().acts_with(
          {"no mesh.file", [&options] { return options.file.empty() || options.shape == MeshShape::file; }}),
      "mesh to generate, of quads: a flat rectangle, a torus round the z axis, a roof (an arch of quads that stand on "
      "their points, so that its boundary is a zigzag), a T-shirt that stands upright, a quad_ellipsoid, closed (a "
      "blown-up cube); of triangles and closed: an icosphere, an ellipsoid, a tube along z with half spheres at its "
      "ends, the smooth surface of the solids mesh.blobs; of triangles and flat: a disc, a square (any rectangle) with "
      "one corner at the origin, a quarter of an airbag; a file, when mesh.file names one, takes its place");
  table.add("mesh.file", options.file, Rules().file().not_read_again(),
            "mesh to read, whatever mesh.shape says: obj, off, ply, stl, vtp, vtu, vtk or msh; or mesh.h5, which "
            "-mesh_only writes, in parallel and as it is: no other option of mesh acts then; empty: generate one");
  table.add("mesh.cells", options.cells,
            of({MeshShape::rectangle, MeshShape::torus, MeshShape::roof, MeshShape::shirt, MeshShape::square})
                .length(2)
                .at_least(1),
            "cells of the generated mesh along its length and width; torus: round the axis and round the tube; square: "
            "each of four triangles; shirt: across the torso and from waist to shoulder, at least 8");
  table.add(
      "mesh.size", options.size,
      of({MeshShape::rectangle, MeshShape::roof, MeshShape::shirt, MeshShape::square}, "m").length(2).more_than(0),
      "length and width of rectangle, roof and square, the roof's width along its arc; shirt: width of the torso laid "
      "flat, half its girth, and height from waist to shoulder");
  table.add("mesh.major_radius", options.major_radius, of({MeshShape::torus}, "m").more_than(0),
            "radius of the circle in the middle of the tube");
  table.add("mesh.tube_radius", options.tube_radius, of({MeshShape::torus}, "m").more_than(0), "radius of the tube");
  table.add("mesh.arch", options.arch, of({MeshShape::roof}, "rad").more_than(0).less_than(2 * pi), "angle of its arc");
  table.add("mesh.level", options.level,
            of({MeshShape::icosphere, MeshShape::ellipsoid, MeshShape::quad_ellipsoid}).range(0, 9),
            "how often the triangles of the icosahedron are split, 10 * 4^level + 2 vertices, or the sides of the "
            "cube, 6 * 4^level quads");
  table.add("mesh.radius", options.radius,
            of({MeshShape::icosphere, MeshShape::tube, MeshShape::disc}, "m").more_than(0), "radius");
  table.add("mesh.semi_axes", options.semi_axes,
            of({MeshShape::ellipsoid, MeshShape::quad_ellipsoid}, "m").more_than(0), "half axes along x, y and z");
  table.add("mesh.length", options.length, of({MeshShape::tube}, "m").more_than(0),
            "length of its cylinder, without the half spheres");
  table.add("mesh.rings", options.rings, of({MeshShape::disc}).at_least(1),
            "rings of triangles between centre and rim, 1 + 3 n (n + 1) vertices");
  table.add("mesh.vertices", options.vertices, of({MeshShape::tube, MeshShape::blobs}).at_least(4),
            "number of vertices");
  table.add_under(generated, [&] {
    table.add_under(one_of("mesh.shape", options.shape, {MeshShape::blobs}), [&] {
      table.add_objects(
          "mesh.blobs", options.blobs,
          "solids whose smooth union, less those that are subtracted, has the surface of the shape blobs");
    });
  });
  const Condition placed{"no mesh.file of -mesh_only, which is in its place",
                         [&options] { return !options.has_partition(); }};
  table.add("mesh.scale", options.scale, Rules().acts_with(placed).more_than(0),
            "factor on all coordinates, such as 0.001 for a file in mm");
  table.add("mesh.volume", options.volume, Rules("m^3").acts_with(placed).more_than(0),
            "then scaled, about the origin, to enclose this volume; the mesh must be closed");
  table.add("mesh.merge", options.merge, Rules().acts_with(placed),
            "points at the same place become one; false keeps them apart, as for two layers that lie on each other");
  table.add("mesh.merge_distance", options.merge_distance,
            Rules("m").acts_with(placed).acts_with({"mesh.merge", [&options] { return options.merge; }}).at_least(0),
            "points no further apart count as at the same place, measured before mesh.volume scales the mesh; 0: at "
            "exactly the same place");
  table.add("mesh.rotation", options.rotation, Rules("rad").acts_with(placed),
            "then turned by these angles about the axes x, y and z, in this order, through the origin");
  table.add("mesh.shift", options.shift, Rules("m").acts_with(placed), "then moved by this vector");
}

namespace {

/// The mesh before it is placed.
SurfaceMesh unplaced_mesh(const MeshOptions& options) {
  if (!options.file.empty()) {
    return read_mesh(options.file);
  }
  refuse_if(options.shape == MeshShape::file,
            "mesh.shape: 'file', but mesh.file is empty, expected the name of a mesh file");
  const std::array<int, 2> cells{options.cells.at(0), options.cells.at(1)};
  const std::array<double, 2> size{options.size.at(0), options.size.at(1)};
  switch (options.shape) {
    case MeshShape::torus:
      return torus_mesh(cells, options.major_radius, options.tube_radius);
    case MeshShape::roof:
      return roof_mesh(cells, size, options.arch);
    case MeshShape::shirt:
      return shirt_mesh(cells, size);
    case MeshShape::icosphere:
      return icosphere_mesh(options.level, options.radius);
    case MeshShape::ellipsoid:
      return ellipsoid_mesh(options.level, options.semi_axes);
    case MeshShape::quad_ellipsoid:
      return quad_ellipsoid_mesh(options.level, options.semi_axes);
    case MeshShape::tube:
      return tube_mesh(options.length, options.radius, options.vertices);
    case MeshShape::blobs:
      return blobs_mesh(options.blobs, options.vertices);
    case MeshShape::disc:
      return disc_mesh(options.rings, options.radius);
    case MeshShape::square:
      return square_mesh(cells, size);
    default:
      return rectangle_mesh(cells, size);
  }
}

}  // namespace

SurfaceMesh make_mesh(const MeshOptions& options) {
  SurfaceMesh mesh = unplaced_mesh(options);
  const Eigen::Matrix3d rotation = rotation_about_axes(options.rotation);
  for (Eigen::Vector3d& point : mesh.points) {
    point = options.shift + rotation * (options.scale * point);
  }
  return mesh;
}

CheckedMesh make_checked_mesh(const MeshOptions& options) {
  CheckedMesh checked;
  auto& [mesh, report] = checked;
  mesh = make_mesh(options);
  report = check_and_repair(mesh, options.name(), options.merge ? std::optional(options.merge_distance) : std::nullopt);
  if (!options.volume) {
    return checked;
  }
  refuse_if(report.boundary_edges > 0, "mesh.volume: {}; expected a closed mesh", report.summary());
  refuse_if(!(report.volume > 0), "mesh.volume: {} encloses no volume, expected a mesh that does", options.name());
  const double factor = std::cbrt(*options.volume / report.volume);
  for (Eigen::Vector3d& point : mesh.points) {
    point = options.shift + factor * (point - options.shift);
  }
  measure_rounding(mesh, report);
  report.volume = *options.volume;
  report.area *= factor * factor;
  report.shortest_edge *= factor;
  report.longest_edge *= factor;
  return checked;
}

}  // namespace pellicle::meshing
